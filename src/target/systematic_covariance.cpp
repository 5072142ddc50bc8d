#include "berth/systematic_covariance.hpp"

#include "target/marker_pose.hpp"
#include "target/pose_steps.hpp"
#include "target/side_covariance.hpp"

namespace berth {
namespace {

// Adds up what one deviation after the other does to the pose: the step that least squares take when the corners are
// where a camera or a marker that is off by one deviation would show them.
class Deviations {
 public:
  Deviations(const CameraModel& camera, double size_m, const Detection& marker)
      : camera_(camera),
        pose_(marker.pose),
        size_m_(size_m),
        // All alike where the fit does not say: only their ratios count.
        corners_(seen_corners_of(size_m, marker.corners, corner_covariance(marker, 1))) {}

  bool add(const CameraModel& camera, double size_m, double edge_px = 0) {
    PoseNormal normal;
    const std::array<Vec3, 4> places = corner_places(size_m);
    for (std::size_t i = 0; i < 4; ++i) corners_.seen_px[i] = image_of(camera, transform(pose_, places[i]));
    if (edge_px > 0) {
      const std::array<Vec2, 4> by = outwards(corners_.seen_px);
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t k = 0; k < 2; ++k) corners_.seen_px[i][k] += edge_px * by[i][k];
      }
    }
    if (!add_corners(camera_, pose_, corners_, normal) || !factorise<6>(normal.matrix)) return false;
    const std::array<double, 6> step = solve<6>(normal.matrix, normal.gradient);
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) covariance_[i * 6 + j] += step[i] * step[j];
    }
    return true;
  }
  /// The camera with `field` off by so much.
  bool add(double CameraModel::*field, double deviation) {
    CameraModel camera = camera_;
    camera.*field += deviation;
    return deviation == 0 || add(camera, size_m_);
  }
  bool add_coefficient(std::size_t i, double deviation) {
    CameraModel camera = camera_;
    camera.distortion[i] += deviation;
    return deviation == 0 || add(camera, size_m_);
  }

  const std::array<double, 36>& covariance() const { return covariance_; }

 private:
  const CameraModel& camera_;
  Pose pose_;
  double size_m_;
  SeenCorners corners_;
  std::array<double, 36> covariance_ = {};
};

}  // namespace

bool systematic_covariance(const CameraModel& camera, double marker_size_m, const Detection& marker,
                           const CalibrationDeviation& deviation, std::array<double, 36>& covariance) {
  if (!marker.has_pose) return false;
  Deviations sum(camera, marker_size_m, marker);
  bool all = sum.add(&CameraModel::fx, deviation.fx) && sum.add(&CameraModel::fy, deviation.fy) &&
             sum.add(&CameraModel::cx, deviation.cx) && sum.add(&CameraModel::cy, deviation.cy) &&
             sum.add(camera, marker_size_m + deviation.marker_size_m) &&
             sum.add(camera, marker_size_m, deviation.edge_px);
  for (std::size_t i = 0; all && i < deviation.distortion.size(); ++i) {
    all = sum.add_coefficient(i, deviation.distortion[i]);
  }
  if (!all) return false;
  covariance = sum.covariance();
  return true;
}

}  // namespace berth
