#include "target/lens_blocks.hpp"

namespace berth {
namespace {

using Point = std::array<double, 2>;

// The quadratic through the middle of a 3 × 3 grid of points 4 px apart and its four neighbours; the corners give the
// mixed term.
Quadratic through(const std::array<Point, 9>& grid, std::size_t axis) {
  const auto at = [&](std::size_t column, std::size_t row) { return grid[3 * row + column][axis]; };
  Quadratic q;
  q.c = at(1, 1);
  q.x = (at(2, 1) - at(0, 1)) / 8;
  q.y = (at(1, 2) - at(1, 0)) / 8;
  q.xx = (at(2, 1) + at(0, 1) - 2 * q.c) / 32;
  q.yy = (at(1, 2) + at(1, 0) - 2 * q.c) / 32;
  q.xy = (at(2, 2) - at(0, 2) - at(2, 0) + at(0, 0)) / 64;
  return q;
}

std::array<float, 6> stored(const Quadratic& q) {
  const auto f = [](double value) { return static_cast<float>(value); };
  return {f(q.c), f(q.x), f(q.y), f(q.xx), f(q.xy), f(q.yy)};
}

}  // namespace

LensBlocks::LensBlocks(const std::optional<CameraModel>& camera, int width, int height)
    : camera_(camera), columns_((width + kSide - 1) / kSide) {
  if (!camera_) return;
  const int rows = (height + kSide - 1) / kSide;
  // Grid points are shared by neighbouring blocks: every fourth pixel of the rows of this row of blocks.
  const int points = 2 * columns_ + 1;
  std::vector<Point> lines(3 * static_cast<std::size_t>(points));
  const auto fill = [&](int line, int y) {
    for (int i = 0; i < points; ++i) {
      lines[static_cast<std::size_t>(line * points + i)] = camera_->undistort(4 * i, y);
    }
  };
  blocks_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows));
  fill(2, 0);
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < points; ++i) {
      lines[static_cast<std::size_t>(i)] = lines[static_cast<std::size_t>(2 * points + i)];
    }
    fill(1, kSide * row + 4);
    fill(2, kSide * row + 8);
    for (int column = 0; column < columns_; ++column) {
      std::array<Point, 9> grid;
      for (int k = 0; k < 9; ++k) {
        grid[static_cast<std::size_t>(k)] = lines[static_cast<std::size_t>(k / 3 * points + 2 * column + k % 3)];
      }
      blocks_.push_back({stored(through(grid, 0)), stored(through(grid, 1))});
    }
  }
}

void LensBlocks::rays(int column, int row, std::size_t lane, Rays& to) const {
  constexpr int kMiddle = kSide / 2;
  to.px[lane] = kSide * column + kMiddle;
  to.py[lane] = kSide * row + kMiddle;
  if (!camera_) {
    for (std::size_t k = 0; k < 6; ++k) to.x[k][lane] = to.y[k][lane] = 0;
    to.x[0][lane] = to.px[lane];
    to.y[0][lane] = to.py[lane];
    to.x[1][lane] = to.y[2][lane] = 1;
    return;
  }
  const Block& block =
      blocks_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column)];
  for (std::size_t k = 0; k < 6; ++k) {
    to.x[k][lane] = block.x[k];
    to.y[k][lane] = block.y[k];
  }
}

std::array<double, 2> LensBlocks::ray(const Point& point_px) const {
  return camera_ ? camera_->undistort(point_px[0], point_px[1]) : point_px;
}

std::array<double, 2> LensBlocks::pixel(const Point& ray, std::array<double, 4>& derivative) const {
  if (camera_) return camera_->project(ray[0], ray[1], derivative);
  derivative = {1, 0, 0, 1};
  return ray;
}

}  // namespace berth
