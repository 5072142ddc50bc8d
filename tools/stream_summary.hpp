#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "berth/detector.hpp"
#include "berth/tracker.hpp"
#include "console.hpp"
#include "engine.hpp"
#include "stream_frame.hpp"
#include "trajectory_svg.hpp"
#include "truth_score.hpp"

namespace berth::cli {

struct StreamOptions;

/// What a stream came to: counts, times, errors against a simulator's truth, a drawing and a picture.
class StreamSummary {
 public:
  explicit StreamSummary(const StreamOptions& options) : options_(options) {}

  /// A frame's result, its poses in metres. Errors and ways are of the first time round alone: what is played for hours
  /// must not fill the memory.
  void add(const StreamFrame& frame, const FrameResult& result, const DetectorConfig& config, bool first_round);
  /// The same frame's poses filtered over time.
  void add_filtered(const StreamFrame& frame, const std::vector<Detection>& filtered);
  /// How it was searched; `cpu_ns` of the processor, 0 where that is not known.
  void add_search(const TrackedFrame& tracked, std::int64_t cpu_ns);
  /// What detection alone took.
  void add_times(std::int64_t wall_ns, std::int64_t cpu_ns);
  /// Two backends disagreed; how often that makes.
  std::uint64_t add_difference() { return ++differing_; }

  std::uint64_t frames() const { return frames_; }
  std::uint64_t with_markers() const { return with_markers_; }
  std::uint64_t differing() const { return differing_; }
  /// Of the detection alone, by the wall clock; 0 before the first frame.
  double frames_per_second() const;

  /// The first line.
  void print_counts(std::ostream& people) const;
  /// How frames were searched, what the camera went through, errors.
  void print_rest(std::ostream& people, const SourceHealth& health) const;
  /// The drawing and the picture that were asked for.
  void write_files(Console& console, std::ostream& people, const Engine& engine) const;

 private:
  using MarkerKey = std::pair<std::string, int>;
  using Way = std::vector<Trajectory::Point>;

  void score_bundles(const FrameResult& result, const std::vector<TruthMarker>& truth,
                     const std::vector<Bundle>& bundles);
  void score_targets(const FrameResult& result, const std::vector<TruthTarget>& truth,
                     const std::vector<DiscTarget>& targets);
  void remember_ways(const std::vector<Detection>& detections, const std::vector<TruthMarker>& truth);
  void keep_picture(View2D<const u8> image, const std::vector<Detection>& detections);
  void print_searches(std::ostream& people) const;
  void write_svg(Console& console, std::ostream& people, const DetectorConfig& config) const;

  const StreamOptions& options_;
  std::uint64_t frames_ = 0, with_markers_ = 0, overflows_ = 0, differing_ = 0;
  std::int64_t wall_ns_ = 0, cpu_ns_ = 0;
  bool has_truth_ = false;
  TruthScore score_, filtered_score_;
  /// What frames that were searched for one reason came to.
  struct Searched {
    std::uint64_t frames = 0;
    std::int64_t cpu_ns = 0;
  };
  std::array<Searched, kSearchReasons> searches_;
  std::map<MarkerKey, Way> ways_;
  GrayImage picture_;
  std::vector<Detection> picture_detections_;
};

}  // namespace berth::cli
