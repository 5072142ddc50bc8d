#pragma once

#include <random>
#include <vector>

#include "berth/image.hpp"
#include "berth/marker.hpp"
#include "target/decode.hpp"
#include "target/quad_map.hpp"

namespace berth {

/// Random numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(u32 seed) : engine_(seed) {}
  u32 word() { return static_cast<u32>(engine_()); }
  double between(double a, double b) { return a + (b - a) * (word() / 4294967296.0); }
  /// Sum of twelve uniforms: normal enough.
  double normal();

 private:
  std::mt19937 engine_;
};

/// How a marker is drawn: grey levels, Gaussian blur of the lens and Gaussian noise (px, grey levels).
struct Look {
  double dark = 40, light = 200;
  double blur_px = 0.6;
  double noise = 1;
};

/// A marker on white paper and its border's true corners: upper left of the upright marker first, clockwise.
struct MarkerScene {
  GrayImage image;
  Corners corners;
};

/// The printed pattern (see marker_pattern), area-sampled, its border at `corners`.
GrayImage draw_marker(const MarkerFamily& family, const std::vector<u8>& pattern, const Corners& corners, int width,
                      int height, const Look& look, Random& random);

/// A square of `side_px` turned and tilted at random about (x, y), in a mild perspective.
Corners random_corners(Random& random, double side_px, double tilt_deg, double x, double y);

/// A marker at random_corners in the middle of an image that it fills.
MarkerScene marker_scene(const MarkerFamily& family, const std::vector<u8>& pattern, double side_px, double tilt_deg,
                         const Look& look, Random& random);

/// Gaussian noise blurred by `sigma`, about mid-grey: what clutter looks like to the decoder.
GrayImage texture(int size, double sigma, double contrast, Random& random);

/// The corners as the device would give them, starting with corner number `first`.
QuadCandidate candidate(const MarkerFamily& family, const Corners& corners, u32 first);

}  // namespace berth
