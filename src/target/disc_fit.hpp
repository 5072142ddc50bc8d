#pragma once

#include <array>
#include <vector>

#include "berth/camera.hpp"
#include "berth/image.hpp"
#include "target/disc_outline.hpp"
#include "target/edge_profile.hpp"

namespace berth {

/// A dark disc or ring measured on the grey levels along its outer edge.
struct FittedDisc {
  /// The ellipse in the plane z = 1 of the camera, where the lens bends nothing. Its centre is not the disc's.
  Ellipse in_plane;
  /// The lens there: px of the image by the plane's units, d(u, v) / d(x, y).
  std::array<double, 4> lens = {};
  /// The centre put into the image, px.
  std::array<double, 2> center_px = {};
  /// Half axes squared, px^2, smaller first.
  std::array<double, 2> axes_px2 = {};
  /// Of the centre, px^2: of x, of x with y, of y; from the residuals.
  std::array<double, 3> covariance_px2 = {};
  /// Grey levels inside and outside of the edge, and one standard deviation of what the model leaves.
  double dark = 0, light = 0, noise = 0;
  /// Blur of the edge with the pixel's own, one standard deviation, px.
  double blur_px = 0;
  /// Light in the middle.
  bool is_ring = false;
};

/// A pixel near an edge, from the place in the image about which the lens is taken to second order.
struct EdgePixel {
  double x = 0, y = 0;
  /// In the undistorted plane, scaled so that both agree at that place.
  std::array<double, 2> local = {};
  double level = 0;
};

/// Fits an ellipse's edge to grey levels (docs/disc-targets.md): centre, shape, blur, the dark level and a plane of
/// light around it by Gauss-Newton on the pixels near the edge. The ellipse is one in the camera's undistorted plane.
/// Doubles of + - * / and sqrt in a fixed order: the same bits on every machine. All memory is taken in the
/// constructor.
class DiscFit {
 public:
  explicit DiscFit(const CameraModel& camera);

  /// From an ellipse nearby, px. Returns false where there is no such edge, it is cut off by the image's border, or
  /// what the model leaves is more than noise.
  bool fit(View2D<const u8> image, const Ellipse& start, FittedDisc& disc);

 private:
  CameraModel camera_;
  EdgeProfile profile_;
  std::vector<EdgePixel> pixels_;
};

}  // namespace berth
