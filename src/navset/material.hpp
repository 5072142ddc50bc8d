#pragma once

#include <memory>
#include <vector>

#include "navset/shape.hpp"
#include "sim/random.hpp"

namespace berth::navset {

enum class Texture : u8 {
  plain,
  foil,    ///< crumpled: `scale` is the size of a facet, each with its own tilt and tone
  cells,   ///< solar cells: `scale` a cell, light lines `second` between them
  bands,   ///< bands along the second coordinate, `scale` wide, of albedo and second
  panels,  ///< sheets with seams, rivets and a label here and there; `scale` a sheet
  racks,   ///< fronts of equipment racks: drawers, labels, knobs; `scale` a rack
  grain,   ///< stone, fabric, dirt: smooth noise between albedo and second
  checks,  ///< a chessboard of albedo and second
  tag      ///< `pattern` over the whole of a plate of half width `scale`
};

/// A square of albedos, row-major.
struct Pattern {
  int side = 0;
  std::vector<double> cells;
};

struct Material {
  double albedo = 0.5;
  double second = 0.5;
  Texture texture = Texture::plain;
  double scale = 0.05;
  /// Strength and sharpness of the highlight: (n·h)^(2^gloss).
  double specular = 0.1;
  int gloss = 4;
  /// Share of the surroundings that the surface mirrors.
  double mirror = 0;
  /// Light of its own.
  double glow = 0;
  u64 seed = 0;
  std::shared_ptr<const Pattern> pattern;
};

struct SurfaceLook {
  double albedo;
  /// Tilt of the normal along the two surface coordinates.
  double tilt_u, tilt_v;
};

/// What a material looks like at surface coordinates u, v (metres).
SurfaceLook look_at(const Material& material, double u, double v);

/// Smooth noise of x, y in -1..1 with wavelength 1, repeatable by seed, and the sum of `octaves` of it.
double smooth_noise(u64 seed, double x, double y);
double fractal_noise(u64 seed, double x, double y, int octaves);

}  // namespace berth::navset
