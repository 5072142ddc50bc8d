#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "berth/camera.hpp"
#include "console.hpp"
#include "frame_observer.hpp"
#include "frame_queue.hpp"
#include "recording_file.hpp"

namespace berth::cli {

/// What `berth run` says about its recording; none with `file` empty.
struct RecordOptions {
  std::string file;
  RecordPictures pictures = RecordPictures::raw;
  /// Frames that may wait for the disk with their pictures.
  int queue = 64;
};

/// Records every frame of a stream in an MCAP file (docs/recording.md). The stream's thread copies a frame into a
/// bounded queue, and a thread of its own writes. Where the disk does not keep up, pictures are dropped first and then
/// whole frames, and counted; where it fails, what is whole stays and the stream goes on.
class Recorder final : public FrameObserver {
 public:
  /// `paced`: frames come whether or not there is room, and none is waited for. Otherwise the stream waits, and nothing
  /// is dropped. `camera`: the source's own. Throws Error where the file cannot be made.
  Recorder(const RecordOptions& options, RecordingSetup setup, bool paced, const std::optional<CameraModel>& camera,
           Console& console);
  /// Ends the file with what was taken so far.
  ~Recorder() override;
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void begin(const ObservedStream& stream) override;
  void observe(const ObservedFrame& frame) override;
  void finish(std::ostream& people) override;

 private:
  void work();
  void write(const QueuedFrame* frame, bool closed);
  void end_file();
  std::uint64_t dropped_frames() const;
  void stop();

  RecordOptions options_;
  RecordingSetup setup_;
  bool paced_;
  std::optional<CameraModel> camera_;
  Console& console_;
  RecordingFile file_;
  std::unique_ptr<FrameQueue> queue_;
  std::thread writer_;
  /// What went wrong in the writer's thread: written before `failed_` is set.
  std::string failure_;
  std::atomic<bool> failed_ = false;
  bool told_ = false;
  /// Frames that came out of the queue, whether or not they could be written.
  std::uint64_t taken_ = 0;
};

}  // namespace berth::cli
