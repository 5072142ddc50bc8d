#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "berth/types.hpp"

namespace berth {

/// One marker family: where its bits lie and which codes are valid. All coordinates are in modules.
struct MarkerFamily {
  std::string name;
  /// Side of the quadrilateral whose corners Berth reports, in modules (AprilTag's width_at_border).
  int border_width = 0;
  /// Side of the whole printed pattern, in modules; data bits may lie outside the border.
  int total_width = 0;
  /// The border quadrilateral is light inside and dark outside (AprilTag's newer families).
  bool reversed_border = false;
  /// Bit i (most significant first) is the module at column bit_x[i], row bit_y[i], from the border's upper left.
  std::vector<int> bit_x, bit_y;
  /// Bit i of the upright marker seen as bit `rotation[i]` after a quarter turn.
  std::vector<int> rotation;
  /// Code words: codes[id], one bit a module, 1 = light.
  std::vector<u64> codes;
  /// Smallest Hamming distance between two code words in any rotation.
  int min_hamming = 0;
};

/// Names of every built-in family: AprilTag 3's, then OpenCV's ArUco dictionaries ("aruco4x4_50", …).
const std::vector<std::string>& family_names();
/// The family of that name. Throws Error that lists near names otherwise.
const MarkerFamily& family(std::string_view name);

/// A pose of the marker in the camera frame: a marker point X is at R·X + t (metres).
struct Pose {
  /// Row-major rotation matrix.
  std::array<double, 9> R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> t = {0, 0, 0};
};

/// How well a pose is known.
struct PoseUncertainty {
  /// Row-major 6 × 6: translation (m), then rotation (rad). The true pose is t + dt, rotation(w) · R: w turns about the
  /// marker's origin, about axes parallel to the camera's.
  std::array<double, 36> covariance = {};
  /// Root mean square distance of the corners from where the pose says they are, px.
  double error_px = 0;
  /// The same, sum of squares in the corners' standard deviations: what least squares make least, and what says which
  /// of two poses it is.
  double chi_square = 0;
  /// A plane seen from far away fits nearly as well tilted the other way: that pose, and its error in px, which may be
  /// the smaller one where corners are not equally well known.
  bool has_other = false;
  Pose other;
  double other_error_px = 0;
  /// As `covariance`, of `other`; and how much larger its chi-square is, never below 0: it is e^(-excess/2) times as
  /// likely.
  std::array<double, 36> other_covariance = {};
  double other_excess = 0;
  /// Ratio of the two errors in standard deviations. 0: no doubt which of the two it is; 1: the corners do not tell.
  double ambiguity() const {
    const double other_square = chi_square + other_excess;
    return !has_other ? 0 : other_square > 0 ? std::sqrt(chi_square / other_square) : 1;
  }
};

/// Covariance of a marker's corners, px²: of x and y of the first, of the second, …; row-major 8 × 8.
using CornerCovariance = std::array<double, 64>;

/// What the photometric fit found a marker to look like (docs/corners.md).
struct CornerFit {
  /// Standard deviation of what the model leaves, grey levels: the noise, where it holds.
  double noise = 0;
  /// Variance of the blur with the pixel's own square, px²: xx, xy, yy.
  std::array<double, 3> blur_px2 = {};
  /// Dark and light were taken block by block, because they are not smooth over the marker: a shadow's edge.
  bool local_levels = false;
};

/// A decoded marker. Corners in the paper's order: the upright marker's upper left first, then counter-clockwise
/// (upper left, lower left, lower right, upper right); px, pixel centres at integer coordinates.
struct Detection {
  const MarkerFamily* family = nullptr;
  int id = 0;
  /// Bits that were read other than the code has them.
  int hamming = 0;
  /// Mean distance of the bits from their threshold, grey levels: how sure the decoding is.
  double margin = 0;
  /// Which of the plan's searches found it: 0 the whole image's, 1 the halved one's, 2 the halved one's for the darkest
  /// (docs/marker-pipeline.md).
  int search = 0;
  std::array<std::array<double, 2>, 4> corners = {};
  /// Where the diagonals meet, px: the image of the square's centre.
  std::array<double, 2> center = {};
  /// Of the corners, from what they were found by (docs/corners.md). Empty where a Detector did not make this.
  std::optional<CornerCovariance> corner_covariance_px2;
  /// Of corners by the photometric fit; empty where it was not asked for or did not hold, and they are the edges'.
  std::optional<CornerFit> corner_fit;
  bool has_pose = false;
  Pose pose;
  /// Of poses by least squares.
  std::optional<PoseUncertainty> pose_uncertainty;
};

/// Makes the pose, with its other solution and covariances, that of a marker `factor` times as large, which gives the
/// same image.
void scale_pose(double factor, Detection& detection);

}  // namespace berth
