#pragma once

#include <vector>

#include "berth/image.hpp"

/// Small images that hurt: made of few values around the decision points, odd sizes, structure that noise lacks.
namespace berth::pictures {

/// Numbers that are the same everywhere (splitmix64).
class Random {
 public:
  explicit Random(u64 seed) : state_(seed) {}
  u64 next();
  /// 0 … below - 1
  int below(int limit) { return static_cast<int>(next() % static_cast<u64>(limit)); }

 private:
  u64 state_;
};

GrayImage uniform(int width, int height, u8 level);
/// Every pixel one of the levels.
GrayImage noise(int width, int height, const std::vector<u8>& levels, u64 seed);
GrayImage checkerboard(int width, int height, int cell);
/// Dark convex quadrilaterals of random place, size and turn with light ones inside, on a light ground, with ±spread
/// noise.
GrayImage quads(int width, int height, int count, int spread, u64 seed);
/// The first `count` cells of a grid of 20 × 19 px hold a dark square with a light one in it: each may be a marker
/// until its last reading has failed. At most as many as the grid has cells.
GrayImage hollow_squares(int width, int height, int count);
/// Nested frames, combs and spirals: contours with notches, holes and long ways.
GrayImage mazes(int width, int height, u64 seed);

}  // namespace berth::pictures
