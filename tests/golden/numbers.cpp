#include "golden/numbers.hpp"

namespace berth::golden {
namespace {

void write_pose(Lines& lines, const std::string& name, const Pose& pose) {
  lines.numbers(name + " t", pose.t.data(), pose.t.size());
  lines.numbers(name + " R", pose.R.data(), pose.R.size());
}

void write(Lines& lines, const std::string& name, const PoseUncertainty& known) {
  lines.numbers(name + " error_px", &known.error_px, 1);
  lines.digest(name + " covariance", known.covariance.data(), known.covariance.size());
  if (!known.has_other) return;
  std::vector<double> other = {known.other_error_px, known.other_excess};
  other.insert(other.end(), known.other.R.begin(), known.other.R.end());
  other.insert(other.end(), known.other.t.begin(), known.other.t.end());
  other.insert(other.end(), known.other_covariance.begin(), known.other_covariance.end());
  lines.digest(name + " other solution", other.data(), other.size());
}

}  // namespace

void write_pose(Lines& lines, const std::string& name, const Detection& marker) {
  if (!marker.has_pose) return;
  write_pose(lines, name, marker.pose);
  if (marker.pose_uncertainty) write(lines, name, *marker.pose_uncertainty);
}

void write(Lines& lines, const std::string& frame, const Detection& marker) {
  const std::string name = frame + " " + marker.family->name + "-" + std::to_string(marker.id);
  lines.integers(name + " hamming", {marker.hamming});
  lines.numbers(name + " margin", &marker.margin, 1);
  lines.numbers(name + " corners", marker.corners[0].data(), 8);
  lines.numbers(name + " center", marker.center.data(), 2);
  if (marker.corner_fit) {
    const CornerFit& fit = *marker.corner_fit;
    lines.numbers(name + " noise", &fit.noise, 1);
    lines.numbers(name + " blur_px2", fit.blur_px2.data(), fit.blur_px2.size());
    lines.integers(name + " local levels", {fit.local_levels ? 1 : 0});
  }
  if (marker.corner_covariance_px2) {
    lines.digest(name + " corner covariance", marker.corner_covariance_px2->data(), 64);
  }
  write_pose(lines, name, marker);
}

void write(Lines& lines, const std::string& frame, const BundlePose& bundle) {
  const std::string name = frame + " bundle";
  lines.integers(name + " used, kept out", {bundle.used, bundle.kept_out, bundle.corners_kept_out});
  if (!bundle.has_pose) return;
  write_pose(lines, name, bundle.pose);
  write(lines, name, bundle.uncertainty);
}

void write(Lines& lines, const std::string& frame, const FilteredPose& filtered) {
  const std::string name = frame + " filter";
  lines.integers(name + " state", {filtered.has_pose ? 1 : 0, filtered.measured ? 1 : 0, filtered.outlier ? 1 : 0,
                                   filtered.sure ? 1 : 0, filtered.jumped ? 1 : 0});
  if (!filtered.has_pose) return;
  write_pose(lines, name, filtered.pose);
  lines.numbers(name + " velocity", filtered.velocity.data(), filtered.velocity.size());
  lines.digest(name + " covariance", filtered.covariance.data(), filtered.covariance.size());
  lines.digest(name + " velocity covariance", filtered.velocity_covariance.data(), filtered.velocity_covariance.size());
}

void write(Lines& lines, const std::string& frame, const RelativePose& relative) {
  const std::string name = frame + " both";
  write_pose(lines, name, relative.pose);
  write(lines, name, relative.uncertainty);
  lines.numbers(name + " disagreement", &relative.disagreement, 1);
  lines.numbers(name + " difference", relative.difference.data(), relative.difference.size());
}

void write(Lines& lines, const std::string& name, const WindowScore& score) {
  lines.integers(name + " sums", {score.sums.begin(), score.sums.end()});
  const NetworkOutput& out = score.output;
  lines.integers(name + " score, x, y, d", {out.score_q15, out.x_q16, out.y_q16, out.d_q16});
}

void write(Lines& lines, const std::string& name, const Sighting& sighting) {
  lines.integers(name + " sighting", {static_cast<long long>(sighting.status), sighting.score_q15, sighting.x_q16,
                                      sighting.y_q16, sighting.d_q16, sighting.window[0], sighting.window[1],
                                      sighting.window[2], sighting.tracked ? 1 : 0, sighting.candidates});
  lines.numbers(name + " bearing", sighting.bearing.data(), sighting.bearing.size());
  lines.numbers(name + " range", &sighting.range_m, 1);
}

}  // namespace berth::golden
