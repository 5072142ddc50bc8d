#include "survey/survey_frames.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace berth {
namespace {

// Of the image's width: a frame from a camera that has moved less repeats its errors, too.
constexpr double kMoved = 0.01;

bool is_same(const Detection& a, const Detection& b) { return a.family == b.family && a.id == b.id; }

// No marker of `frame` is elsewhere than in `earlier`, or was not there.
bool repeats(const SurveyFrame& frame, const SurveyFrame& earlier, double moved_px) {
  return std::all_of(frame.markers.begin(), frame.markers.end(), [&](const Detection& marker) {
    const auto before = std::find_if(earlier.markers.begin(), earlier.markers.end(),
                                     [&](const Detection& other) { return is_same(marker, other); });
    if (before == earlier.markers.end()) return false;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto &a = marker.corners[k], &b = before->corners[k];
      const double dx = a[0] - b[0], dy = a[1] - b[1];
      if (dx * dx + dy * dy > moved_px * moved_px) return false;
    }
    return true;
  });
}

}  // namespace

SurveyFrames::SurveyFrames(int width_px, std::size_t most) : most_(most), moved_px_(kMoved * width_px) {}

bool SurveyFrames::is_repeated(const SurveyFrame& frame) const {
  return std::any_of(frames_.begin(), frames_.end(),
                     [&](const SurveyFrame& earlier) { return repeats(frame, earlier, moved_px_); });
}

SurveyFrames::Verdict SurveyFrames::add(SurveyFrame frame) {
  std::vector<Detection> once;
  for (const Detection& marker : frame.markers) {
    const auto count = std::count_if(frame.markers.begin(), frame.markers.end(),
                                     [&](const Detection& other) { return is_same(marker, other); });
    if (count == 1) once.push_back(marker);
  }
  frame.markers = std::move(once);
  if (frame.markers.size() < 2) {
    ++alone_;
    return Verdict::alone;
  }
  if (is_repeated(frame)) {
    ++repeated_;
    return Verdict::repeated;
  }
  frames_.push_back(std::move(frame));
  // A longer way between frames thins out what there are many of; a pair of markers seen but once stays. The bound on
  // the way is for more pairs than frames that may be.
  while (frames_.size() > most_ && moved_px_ < 1e4) {
    moved_px_ *= 1.5;
    std::vector<SurveyFrame> all;
    std::swap(all, frames_);
    for (SurveyFrame& each : all) {
      if (is_repeated(each)) {
        ++repeated_;
      } else {
        frames_.push_back(std::move(each));
      }
    }
  }
  return Verdict::taken;
}

}  // namespace berth
