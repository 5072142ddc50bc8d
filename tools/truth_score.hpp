#pragma once

#include <array>
#include <map>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "berth/source.hpp"

namespace berth::cli {

/// One marker of a simulated stream: how often it was found, and how far off the findings were.
struct MarkerScore {
  double size_m = 0;
  /// Frames that showed it wholly (visible ≥ 0.999), and those of them in which it was found.
  int shown = 0, found = 0;
  /// Of every frame in which it was found, in order; the pose's only where there was one.
  std::vector<double> corner_px, position_mm, position_percent, rotation_deg;
};

/// One bundle or target of discs of a simulated stream, frame by frame in which it had a pose.
struct BodyScore {
  int frames = 0;
  std::vector<double> position_mm, position_percent, rotation_deg;
};

/// Compares detections with a simulator's truth.
class TruthScore {
 public:
  void add(const std::vector<TruthMarker>& truth, const std::vector<Detection>& detections);

  /// A frame's pose of a bundle or a target of discs ("bundle dock") and what it truly is; null where there was none.
  void add_body(const std::string& label, const Pose* pose, const Pose& truth);

  /// By family and id.
  const std::map<std::pair<std::string, int>, MarkerScore>& markers() const { return markers_; }
  /// Detections of markers that the frame did not show.
  int false_positives() const { return false_positives_; }
  /// The table: a row a marker, then a row a bundle or a target; medians and maxima.
  void print(std::ostream& out) const;

 private:
  std::map<std::pair<std::string, int>, MarkerScore> markers_;
  std::map<std::string, BodyScore> bodies_;
  int false_positives_ = 0;
};

/// The truth about a detection: the marker of its family and id; null when the frame shows none.
const TruthMarker* truth_of(const Detection& detection, const std::vector<TruthMarker>& truth);

/// Distance of two poses' origins, m.
double distance_m(const Pose& a, const Pose& b);
/// Angle of the rotation between two poses, degrees; for people to read.
double angle_deg(const Pose& a, const Pose& b);
/// Root mean square distance of the corners, px.
double corner_rmse_px(const std::array<std::array<double, 2>, 4>& a, const std::array<std::array<double, 2>, 4>& b);

}  // namespace berth::cli
