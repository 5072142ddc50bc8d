#pragma once

#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/marker.hpp"
#include "berth/systematic_covariance.hpp"
#include "calibration/view_set.hpp"
#include "target/board.hpp"

namespace berth {

/// A camera from views of a board, and how well it is known.
struct Calibration {
  CameraModel camera;
  /// One standard deviation of fx, fy, cx, cy (px), then of the lens's coefficients: k1, k2, p1, p2, k3 or k1 … k4.
  /// They follow from the residuals, taken as independent.
  std::vector<double> deviations;
  /// Root mean square of the points' residuals in x and y together, px.
  double rms_px = 0;

  struct View {
    /// Board frame to camera frame.
    Pose pose;
    double rms_px = 0;
    /// Seen minus predicted, px, of each of the view's points.
    std::vector<std::array<double, 2>> residuals_px;
  };
  std::vector<View> views;

  /// Largest angle between two views' boards, degrees.
  double tilt_range_deg() const;
  /// Why the result is not to be trusted, with what to do; empty when all is well.
  std::vector<std::string> objections(const ViewSet& set) const;
};

/// Its deviations as systematic_covariance takes them.
CalibrationDeviation deviation_of(const Calibration& calibration);
/// Names of Calibration::deviations, in order.
std::vector<std::string> parameter_names(LensModel lens);
/// Their values.
std::vector<double> parameters(const CameraModel& camera);

/// Zhang's method (Zhang 2000) by OpenCV, for a pinhole with the lens's coefficients. Throws Error when OpenCV finds no
/// solution.
Calibration calibrate(const Board& board, const ViewSet& set, LensModel lens);

}  // namespace berth
