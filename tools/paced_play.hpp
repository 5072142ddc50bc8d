#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "berth/pipeline.hpp"
#include "berth/source.hpp"
#include "console.hpp"
#include "frame_json.hpp"
#include "interrupt.hpp"
#include "paced_camera.hpp"
#include "play.hpp"

namespace berth::cli {

/// How frames are taken at a camera's pace, through a pipeline.
struct PaceOptions {
  /// Frames of recordings are played at that rate; 0 for not at all.
  double fps = 0;
  /// Frames of a camera, at its own rate.
  bool stream = false;
  /// The frames go round until then; 0 for once through.
  double minutes = 0;
  int slots = 4;
  /// With tracking: windows go by the result so many frames before (TrackerConfig::behind).
  int behind = 2;
  std::vector<int> cores;
  /// SCHED_FIFO priority of camera, device and host, and one less of the reader; 0 for none.
  int realtime = 0;
  std::vector<double> deadlines_ms = {14.3, 33};
};

/// What these and other options of the pipeline stand under in --help.
constexpr const char* kPaceGroup = "At a camera's pace";
/// --slots, --cores, --realtime, --deadline
std::vector<CLI::Option*> add_pace_options(CLI::App& command, PaceOptions& pace);

/// Throws Error that names the field, its value and the remedy.
PipelineConfig make_pipeline_config(const PaceOptions& options, DetectorConfig detector,
                                    std::optional<TrackerConfig> tracking = {});

/// The source's frames, `most` of them (0 for all), for a camera that plays them: of another size than the first one's
/// they are complained about and passed over. Throws Error where they take more than 2 GB.
std::vector<SourceFrame> read_to_play(Source& source, std::uint64_t most, Console& console,
                                      const InterruptWatch& interrupt);

/// Frames in memory, played in real time into a pipeline.
class PacedPlay final : public Play {
 public:
  /// Frames of one size, one at least.
  PacedPlay(std::vector<SourceFrame> frames, const PaceOptions& options, const std::vector<Backend*>& backends,
            const PipelineConfig& config);
  ~PacedPlay() override;
  PacedPlay(const PacedPlay&) = delete;
  PacedPlay& operator=(const PacedPlay&) = delete;

  /// Starts the threads; the calling one is the reader. Throws Error where a core or a priority cannot be had.
  void start();
  /// The next result, waiting for it; null at the end. Throws there what went wrong in the pipeline's threads.
  const PipelineFrame* next();
  /// What a result was made of, and whether it is of the first time round.
  const SourceFrame& source_of(const PipelineFrame& frame) const;
  bool is_first_round(const PipelineFrame& frame) const { return frame.result->stamp.sequence < frames_.size(); }
  PipelineCounts counts() const override { return pipeline_.counts(); }
  HealthReport engine() const override { return pipeline_.health(); }
  /// Ends the play early.
  void end() { camera_.end(); }

  /// For people, at the start and at the end.
  void describe(std::ostream& out) const;
  void sum_up(std::ostream& out) const override;
  Json summary() const override;

 private:
  void note_result(const PipelineFrame& frame);
  u64 digest() const;
  std::size_t frames_seen() const;
  void sample_memory();

  std::vector<SourceFrame> frames_;
  PaceOptions options_;
  std::uint64_t total_;
  Pipeline pipeline_;
  PacedCamera camera_;  // ends before the pipeline does
  /// Of each frame's first result; later ones that differ are counted.
  struct Seen {
    u64 digest = 0;
    std::uint64_t times = 0;
  };
  std::vector<Seen> seen_;
  std::uint64_t differing_ = 0;
  /// Resident memory of the process, kB, every ten seconds.
  std::vector<std::int64_t> resident_kb_;
  std::int64_t next_sample_ns_ = 0;
};

}  // namespace berth::cli
