#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "berth/pipeline.hpp"
#include "camera/sources.hpp"
#include "paced_play.hpp"
#include "play.hpp"

namespace berth::cli {

/// A camera's frames through a pipeline: a thread of its own writes each straight into a slot.
class CameraPlay final : public Play {
 public:
  /// `most` frames, 0 for all. Only this object uses the camera until it is gone, but for label_of.
  CameraPlay(CameraSource& camera, const PaceOptions& options, const std::vector<Backend*>& backends,
             const PipelineConfig& config, std::uint64_t most);
  ~CameraPlay() override;
  CameraPlay(const CameraPlay&) = delete;
  CameraPlay& operator=(const CameraPlay&) = delete;

  /// Starts the threads; the calling one is the reader. Throws Error where a core or a priority cannot be had.
  void start();
  /// The next result, waiting for it, but not for long: none where nothing came, or the camera has
  /// complained meanwhile, or at the end.
  const PipelineFrame* next();
  /// What the camera complained of since this was asked last: it was lost, and is opened again.
  std::vector<std::string> take_complaints();
  /// All is fetched, and the camera's thread has ended. Throws what went wrong in the pipeline's threads.
  bool has_ended();
  /// Ends the play; the camera may wait for its next frame until then.
  void end() { ended_ = true; }
  /// Results a second so far.
  double frames_per_second() const;

  void describe(std::ostream& out) const;
  PipelineCounts counts() const override { return pipeline_.counts(); }
  HealthReport engine() const override { return pipeline_.health(); }
  SourceHealth health() const override;
  void sum_up(std::ostream& out) const override;
  Json summary() const override;

 private:
  void film();
  bool has_complaint();

  CameraSource& camera_;
  const PaceOptions options_;
  const std::uint64_t most_;
  Pipeline pipeline_;
  std::atomic<bool> ended_ = false, is_over_ = false;
  bool is_drained_ = false;
  mutable std::mutex mutex_;
  SourceHealth health_;  // as the camera's thread last saw it
  std::vector<std::string> complaints_;
  std::chrono::steady_clock::time_point began_;
  std::thread thread_;
};

}  // namespace berth::cli
