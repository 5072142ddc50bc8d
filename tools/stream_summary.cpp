#include "stream_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "annotate.hpp"
#include "bundle_show.hpp"
#include "frame_json.hpp"
#include "output_file.hpp"
#include "stream.hpp"
#include "target_show.hpp"

namespace berth::cli {

void StreamSummary::add(const StreamFrame& frame, const FrameResult& result, const DetectorConfig& config,
                        bool first_round) {
  ++frames_;
  with_markers_ += result.detections.empty() && !any_found(result.disc_targets) ? 0 : 1;
  overflows_ += result.status == FrameStatus::overflow ? 1 : 0;
  if (!frame.truth.empty() && first_round) {
    score_.add(frame.truth, result.detections);
    score_bundles(result, frame.truth, config.bundles);
    has_truth_ = true;
  }
  if (first_round) score_targets(result, frame.truth_targets, config.disc_targets);
  if (!options_.svg.empty() && first_round) remember_ways(result.detections, frame.truth);
  if (!options_.picture.empty() && !result.detections.empty() &&
      result.detections.size() >= picture_detections_.size()) {
    keep_picture(frame.image, result.detections);
  }
}

void StreamSummary::add_filtered(const StreamFrame& frame, const std::vector<Detection>& filtered) {
  if (!frame.truth.empty()) filtered_score_.add(frame.truth, filtered);
}

void StreamSummary::add_search(const TrackedFrame& tracked, std::int64_t cpu_ns) {
  Searched& searched = searches_[static_cast<std::size_t>(tracked.why)];
  ++searched.frames;
  searched.cpu_ns += cpu_ns;
}

void StreamSummary::add_times(std::int64_t wall_ns, std::int64_t cpu_ns) {
  wall_ns_ += wall_ns;
  cpu_ns_ += cpu_ns;
}

double StreamSummary::frames_per_second() const {
  return wall_ns_ > 0 ? static_cast<double>(frames_) * 1e9 / static_cast<double>(wall_ns_) : 0;
}

void StreamSummary::score_bundles(const FrameResult& result, const std::vector<TruthMarker>& truth,
                                  const std::vector<Bundle>& bundles) {
  for (std::size_t i = 0; i < result.bundles.size(); ++i) {
    Pose true_pose;
    if (!truth_of(bundles[i], truth, true_pose)) continue;
    score_.add_body("bundle " + bundles[i].name, result.bundles[i].has_pose ? &result.bundles[i].pose : nullptr,
                    true_pose);
  }
}

void StreamSummary::score_targets(const FrameResult& result, const std::vector<TruthTarget>& truth,
                                  const std::vector<DiscTarget>& targets) {
  for (std::size_t i = 0; i < result.disc_targets.size(); ++i) {
    const TruthTarget* known = truth_of(targets[i], truth);
    if (known == nullptr) continue;
    const DiscPose& found = result.disc_targets[i];
    score_.add_body("target " + targets[i].name, found.has_pose ? &found.pose : nullptr, known->pose);
    has_truth_ = true;
  }
}

void StreamSummary::remember_ways(const std::vector<Detection>& detections, const std::vector<TruthMarker>& truth) {
  for (const TruthMarker& marker : truth) ways_[{marker.family, marker.id}].push_back({marker.pose, std::nullopt});
  for (const Detection& detection : detections) {
    if (!detection.has_pose) continue;
    Way& way = ways_[{detection.family->name, detection.id}];
    if (truth_of(detection, truth) == nullptr) way.emplace_back();
    way.back().estimate = detection.pose;
  }
}

void StreamSummary::keep_picture(View2D<const u8> image, const std::vector<Detection>& detections) {
  if (picture_.width() != image.width || picture_.height() != image.height) {
    picture_ = GrayImage(image.width, image.height);
  }
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(picture_.view().row(y), image.row(y), static_cast<std::size_t>(image.width));
  }
  picture_detections_ = detections;
}

void StreamSummary::print_counts(std::ostream& people) const {
  people << fmt::format("{} frame{}, {} with markers", frames_, frames_ == 1 ? "" : "s", with_markers_);
  if (overflows_ > 0) people << fmt::format(", {} overflowed", overflows_);
  if (!options_.engine.lockstep.empty()) people << fmt::format(", {} differing", differing_);
  if (frames_ > 0 && wall_ns_ > 0) {
    const auto mean_ms = [&](std::int64_t ns) { return ms_of(ns) / static_cast<double>(frames_); };
    people << fmt::format("; detection alone {:.3f} ms a frame ({:.0f} frames/s), {:.3f} ms of processor time",
                          mean_ms(wall_ns_), frames_per_second(), mean_ms(cpu_ns_));
  }
  people << '\n';
}

void StreamSummary::print_searches(std::ostream& people) const {
  for (std::size_t i = 0; i < searches_.size(); ++i) {
    const Searched& searched = searches_[i];
    if (searched.frames == 0) continue;
    const SearchReason why = static_cast<SearchReason>(i);
    people << fmt::format(
        "  {:<24} {} frame{}",
        why == SearchReason::held ? std::string("in windows") : fmt::format("whole: {}", name_of(why)), searched.frames,
        searched.frames == 1 ? "" : "s");
    if (searched.cpu_ns > 0) {
      people << fmt::format(", {:.3f} ms of processor time each",
                            ms_of(searched.cpu_ns) / static_cast<double>(searched.frames));
    }
    people << '\n';
  }
}

void StreamSummary::print_rest(std::ostream& people, const SourceHealth& health) const {
  print_searches(people);
  // Nothing of files, nor of a camera that went through nothing.
  if (health.lost + health.incomplete + health.skipped + health.repeated + health.misdated + health.reopened > 0) {
    people << fmt::format(
        "  camera: {} frames skipped for newer ones, {} lost before they came, {} incomplete, {} repeated, {} with "
        "impossible times; opened again {} times\n",
        health.skipped, health.lost, health.incomplete, health.repeated, health.misdated, health.reopened);
  }
  if (!has_truth_) return;
  score_.print(people);
  if (options_.filter) {
    people << "filtered over time:\n";
    filtered_score_.print(people);
  }
}

void StreamSummary::write_files(Console& console, std::ostream& people, const Engine& engine) const {
  if (!options_.svg.empty()) write_svg(console, people, engine.config());
  if (options_.picture.empty() || picture_detections_.empty()) return;
  write_annotated(options_.picture, picture_.view(), picture_detections_,
                  engine.camera_for(picture_.width(), picture_.height()));
  people << "picture     " << options_.picture << '\n';
}

void StreamSummary::write_svg(Console& console, std::ostream& people, const DetectorConfig& config) const {
  const std::pair<const MarkerKey, Way>* most = nullptr;
  const auto found = [](const Way& way) {
    return std::count_if(way.begin(), way.end(), [](const Trajectory::Point& p) { return p.estimate.has_value(); });
  };
  for (const auto& way : ways_) {
    if (most == nullptr || found(way.second) > found(most->second)) most = &way;
  }
  if (most == nullptr || found(most->second) == 0) {
    console.note(options_.svg + ": not written, no marker had a pose");
    return;
  }
  Trajectory trajectory;
  trajectory.title = fmt::format("{} {} in the camera frame, {} of {} frames", most->first.first, most->first.second,
                                 found(most->second), frames_);
  const auto scored = score_.markers().find(most->first);
  trajectory.size_m = scored != score_.markers().end()
                          ? scored->second.size_m
                          : marker_size_m(config, family(most->first.first), most->first.second);
  trajectory.points = most->second;
  write_file(options_.svg, "the drawing", trajectory_svg(trajectory));
  people << "trajectory  " << options_.svg << '\n';
}

}  // namespace berth::cli
