#pragma once

#include <array>
#include <string>
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
const MarkerFamily& family(const std::string& name);

/// A pose of the marker in the camera frame: a marker point X is at R·X + t (metres).
struct Pose {
  /// Row-major rotation matrix.
  std::array<double, 9> R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<double, 3> t = {0, 0, 0};
};

/// A decoded marker. Corners in the paper's order: the upright marker's upper left first, then counter-clockwise
/// (upper left, lower left, lower right, upper right); px, pixel centres at integer coordinates.
struct Detection {
  const MarkerFamily* family = nullptr;
  int id = 0;
  int hamming = 0;
  /// Mean distance of the bits from their threshold, grey levels: how sure the decoding is.
  double margin = 0;
  std::array<std::array<double, 2>, 4> corners = {};
  std::array<double, 2> center = {};
  bool has_pose = false;
  Pose pose;
};

}  // namespace berth
