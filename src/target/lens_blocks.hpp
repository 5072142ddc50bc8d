#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "berth/camera.hpp"

namespace berth {

/// c + x dx + y dy + xx dx² + xy dx dy + yy dy².
struct Quadratic {
  double c = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

/// The plane in which a marker's edges are straight, as a function of the image: the lens' rays (x/z, y/z), or the
/// image itself where no camera is known. Kept as a quadratic for every block of 8 × 8 pixels, computed once: within
/// 1e-4 px of the lens wherever it bends less than the paper's does in a 320 × 240 image.
class LensBlocks {
 public:
  static constexpr int kSide = 8;

  LensBlocks(const std::optional<CameraModel>& camera, int width, int height);

  /// Four blocks, a lane each: the plane's coordinates about the blocks' middles, coefficients as in Quadratic; those
  /// middles, px.
  struct Rays {
    using Lanes = std::array<double, 4>;
    using Coordinate = std::array<Lanes, 6>;
    alignas(32) Coordinate x, y;
    alignas(32) Lanes px, py;
  };
  /// Puts a block into a lane. Its middle is pixel (8 column + 4, 8 row + 4).
  void rays(int column, int row, std::size_t lane, Rays& to) const;
  /// The plane's point of an image point (px).
  std::array<double, 2> ray(const std::array<double, 2>& point_px) const;
  /// The image point (px) of the plane's, and its derivative: du/dx, du/dy, dv/dx, dv/dy.
  std::array<double, 2> pixel(const std::array<double, 2>& ray, std::array<double, 4>& derivative) const;

 private:
  // In floats, which are within 1e-4 px of the doubles in images up to some 3,000 px wide: half the memory to fetch,
  // and more is fetched than computed.
  struct Block {
    std::array<float, 6> x, y;
  };
  std::optional<CameraModel> camera_;
  int columns_ = 0;
  std::vector<Block> blocks_;  // empty without a camera
};

}  // namespace berth
