#include "target/marker_pose.hpp"

#include <utility>

#include "pose_algebra.hpp"
#include "target/planar_pose.hpp"
#include "target/refine_pose.hpp"

namespace berth {
bool faces_camera(const Pose& marker) { return dot(column(marker.R, 2), marker.t) > 0; }

CornerCovariance independent_corners(double deviation_px) {
  CornerCovariance covariance{};
  for (std::size_t i = 0; i < 8; ++i) covariance[9 * i] = deviation_px * deviation_px;
  return covariance;
}

CornerCovariance corner_covariance(const Detection& marker, double deviation_px) {
  return marker.corner_covariance_px2 ? *marker.corner_covariance_px2 : independent_corners(deviation_px);
}

std::array<double, 3> block_of(const CornerCovariance& covariance_px2, std::size_t corner) {
  const double* const first = &covariance_px2[18 * corner];
  return {first[0], first[1], first[9]};
}

SeenCorners seen_corners_of(double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                            const CornerCovariance& covariance_px2) {
  SeenCorners seen;
  seen.count = 4;
  seen.points_m = corner_places(size_m);
  seen.seen_px = corners_px;
  if (!seen.set_covariance(covariance_px2)) seen.count = 0;
  return seen;
}

bool marker_pose(const CameraModel& camera, double size_m, double deviation_px,
                 const std::array<std::array<double, 2>, 4>& corners_px, Pose& pose, PoseUncertainty& uncertainty) {
  return marker_pose(camera, size_m, corners_px, independent_corners(deviation_px), pose, uncertainty);
}

bool marker_pose(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                 const CornerCovariance& covariance_px2, Pose& pose, PoseUncertainty& uncertainty) {
  std::array<Pose, 2> starts;
  const int count = planar_poses(camera, size_m, corners_px, starts);
  const SeenCorners corners = seen_corners_of(size_m, corners_px, covariance_px2);
  std::array<RefinedPose, 2> refined;
  std::size_t found = 0;
  for (int k = 0; k < count; ++k) {
    RefinedPose& result = refined[found];
    if (refine_pose(camera, &corners, 1, starts[static_cast<std::size_t>(k)], result) && faces_camera(result.pose)) {
      ++found;
    }
  }
  if (found == 0) return false;
  if (found == 2 && refined[1].chi_square < refined[0].chi_square) std::swap(refined[0], refined[1]);
  pose = refined[0].pose;
  const bool has_other = found == 2 && !same_pose(refined[0], refined[1]);
  uncertainty = uncertainty_of(refined[0], has_other ? &refined[1] : nullptr);
  return true;
}

void scale_pose(double factor, Detection& detection) {
  detection.pose.t = scaled(detection.pose.t, factor);
  if (!detection.pose_uncertainty) return;
  PoseUncertainty& uncertainty = *detection.pose_uncertainty;
  uncertainty.other.t = scaled(uncertainty.other.t, factor);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      const double by = (i < 3 ? factor : 1) * (j < 3 ? factor : 1);
      uncertainty.covariance[i * 6 + j] *= by;
      uncertainty.other_covariance[i * 6 + j] *= by;
    }
  }
}

}  // namespace berth
