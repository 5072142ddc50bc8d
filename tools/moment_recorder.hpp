#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "bounded_worker.hpp"
#include "console.hpp"
#include "message_file.hpp"
#include "moment_health.hpp"
#include "moment_messages.hpp"
#include "moment_observer.hpp"

namespace berth::cli {

/// What a recording of moments is, beside them.
struct MomentRecording {
  std::string file;
  /// The stations' own file, which is attached, and the settings beside it.
  std::string stations_file;
  std::map<std::string, std::string> settings;
  VehicleFrames frames;
  /// Of FusedPose::disagree.
  double gate = 0;
};

/// Records what two stations' moments come to in an MCAP file (docs/recording.md). The moments' thread copies one into
/// a free slot, and a thread of its own writes; where there is none, moments of cameras are dropped and counted, others
/// wait. Where the disk fails what is whole stays and the stations go on.
class MomentRecorder final : public MomentObserver {
 public:
  MomentRecorder(MomentRecording recording, Console& console);
  /// Ends the file with what was taken so far.
  ~MomentRecorder() override;
  MomentRecorder(const MomentRecorder&) = delete;
  MomentRecorder& operator=(const MomentRecorder&) = delete;

  /// Makes the file. Throws Error.
  void begin() override;
  void observe(const ObservedMoment& observed) override;
  void finish(const BothCounts& counts, std::ostream& people) override;

 private:
  struct Item {
    std::int64_t came_ns = 0;
    StationMoment moment;
    FusedPose fused;
    BothCounts counts;
  };

  // On the writer's thread, and the last two after it.
  void write(const Item& item);
  void write_health(std::int64_t came_ns);
  void keep_up();
  void end_file();
  /// Does one of these, and ends the recording where that fails.
  template <class Work>
  void guarded(const Work& work);

  const MomentRecording recording_;
  Console& console_;
  MomentHealth health_;
  std::chrono::steady_clock::time_point next_health_;
  std::unique_ptr<MessageFile> file_;
  mcap::u16 pose_ = 0, transform_ = 0, diagnostics_ = 0, record_ = 0;
  /// Written, and after a failure those that stayed; in chunks that were ended.
  std::uint64_t moments_ = 0, whole_moments_ = 0;
  std::uint64_t observed_ = 0;
  /// That found no free slot.
  std::atomic<std::uint64_t> dropped_ = 0;
  /// What went wrong in the writer's thread: written before `failed_` is set.
  std::string failure_;
  std::atomic<bool> failed_ = false;
  bool told_ = false;
  std::unique_ptr<BoundedWorker<Item>> worker_;
};

}  // namespace berth::cli
