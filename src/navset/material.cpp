#include "navset/material.hpp"

#include <algorithm>
#include <cmath>

namespace berth::navset {
namespace {

using sim::scatter;
using sim::unit;

// One scatter is enough for a texture: the multipliers keep neighbours apart.
u64 cell_hash(u64 seed, long long i, long long j) {
  return scatter(seed + static_cast<u64>(i) * 0x9e3779b97f4a7c15u + static_cast<u64>(j) * 0xc2b2ae3d27d4eb4fu);
}

// A second and third number out of a hash.
double low_unit(u64 hash, int shift) { return static_cast<double>((hash >> shift) & 0xffffu) * (1.0 / 65536.0); }

double fraction(double x) { return x - static_cast<double>(floor_int(x)); }

SurfaceLook foil(const Material& m, double u, double v) {
  // Sheared squares cut along a diagonal: triangles, as crumpled foil has.
  const double a = u / m.scale + 0.5 * v / m.scale, b = v / m.scale;
  const long long i = floor_int(a), j = floor_int(b);
  const double fa = a - static_cast<double>(i), fb = b - static_cast<double>(j);
  const u64 hash = cell_hash(m.seed + (fa + fb > 1 ? 7 : 0), i, j);
  // Gentle long folds on top of the facets.
  const double fold = smooth_noise(m.seed + 99, u / (4 * m.scale), v / (4 * m.scale));
  return {m.albedo * (0.8 + 0.4 * unit(hash)), 0.5 * (low_unit(hash, 0) - 0.5) + 0.25 * fold,
          0.5 * (low_unit(hash, 16) - 0.5) + 0.2 * fold};
}

double cells(const Material& m, double u, double v) {
  const double a = u / m.scale, b = v / m.scale;
  const long long i = floor_int(a), j = floor_int(b);
  const double fa = a - static_cast<double>(i), fb = b - static_cast<double>(j);
  if (fa < 0.07 || fb < 0.07) return m.second;
  const double tone = m.albedo * (0.85 + 0.3 * unit(cell_hash(m.seed, i, j)));
  return fraction(fa * 6) < 0.15 ? tone + 0.15 * (m.second - tone) : tone;
}

double panels(const Material& m, double u, double v) {
  const double a = u / m.scale, b = v / (1.4 * m.scale);
  const long long i = floor_int(a), j = floor_int(b);
  const double fa = a - static_cast<double>(i), fb = b - static_cast<double>(j);
  if (fa < 0.02 || fb < 0.015) return 0.35 * m.albedo;
  const u64 hash = cell_hash(m.seed, i, j);
  const double tone = m.albedo * (0.9 + 0.2 * unit(hash));
  if ((hash & 3u) == 0 && fa > 0.3 && fa < 0.7 && fb > 0.4 && fb < 0.62) {
    // A label: lines of something.
    return fraction(fb * 24) < 0.5 && low_unit(cell_hash(hash, floor_int(fa * 30), floor_int(fb * 24)), 0) < 0.6
               ? m.second
               : std::min(1.0, 1.25 * tone);
  }
  const double ru = fraction(fa * 8) - 0.5, rv = fraction(fb * 8) - 0.5;
  const bool rim = fa < 0.12 || fa > 0.89 || fb < 0.12 || fb > 0.89;
  if (rim && ru * ru + rv * rv < 0.03) return 0.6 * tone;
  return tone;
}

double racks(const Material& m, double u, double v) {
  const double a = u / m.scale, b = v / m.scale;
  const long long i = floor_int(a);
  const u64 column = cell_hash(m.seed, i, 0);
  // Each rack has drawers of its own height.
  const double drawers = 2 + static_cast<double>((column >> 8) % 5);
  const long long j = floor_int(b * drawers);
  const double fa = a - static_cast<double>(i), fb = b * drawers - static_cast<double>(j);
  if (fa < 0.03 || fa > 0.97) return 0.3 * m.albedo;
  if (fb < 0.05) return 0.4 * m.albedo;
  const u64 hash = cell_hash(m.seed + 1, i, j);
  double tone = (hash & 7u) == 0 ? 0.12 : (hash & 7u) == 1 ? m.second : m.albedo * (0.75 + 0.4 * unit(hash));
  switch ((hash >> 4) & 7u) {
    case 0:  // ventilation slots
      if (fb > 0.25 && fb < 0.8 && fa > 0.2 && fa < 0.8 && fraction(fa * 20) < 0.45) tone *= 0.35;
      break;
    case 1:  // a row of connectors
    case 2: {
      const double du = fraction(fa * 7) - 0.5, dv = (fb - 0.5) * 7 / drawers;
      if (du * du + dv * dv < 0.09) tone = 0.1;
      break;
    }
    case 3:  // a screen
      if (fb > 0.2 && fb < 0.85 && fa > 0.15 && fa < 0.6) {
        tone = 0.08 + 0.5 * low_unit(cell_hash(hash, floor_int(fa * 24), floor_int(fb * 9)), 0) *
                          (fraction(fb * 9) < 0.5 ? 1 : 0);
      }
      break;
    case 4:  // a handle
      if (fb > 0.42 && fb < 0.56 && fa > 0.25 && fa < 0.75) tone = 0.85;
      break;
    case 5:  // labels
      if (fb > 0.6 && fb < 0.85 && fa > 0.1 && fa < 0.4) {
        tone = low_unit(cell_hash(hash, floor_int(fa * 60), floor_int(fb * 14)), 0) < 0.45 ? 0.1 : 0.9;
      }
      break;
    default:
      break;
  }
  return tone;
}

}  // namespace

double smooth_noise(u64 seed, double x, double y) {
  const long long i = floor_int(x), j = floor_int(y);
  double fx = x - static_cast<double>(i), fy = y - static_cast<double>(j);
  fx = fx * fx * (3 - 2 * fx);
  fy = fy * fy * (3 - 2 * fy);
  // Noise is the inner loop of many a background: half a scatter will do.
  const auto node = [](u64 h) {
    h ^= h >> 29;
    h *= 0xbf58476d1ce4e5b9u;
    h ^= h >> 32;
    return static_cast<double>(h & 0xffffffu) * (1.0 / 16777216.0);
  };
  constexpr u64 kRight = 0x9e3779b97f4a7c15u, kDown = 0xc2b2ae3d27d4eb4fu;
  const u64 base = seed * 0x94d049bb133111ebu + static_cast<u64>(i) * kRight + static_cast<u64>(j) * kDown;
  const double low = node(base) * (1 - fx) + node(base + kRight) * fx;
  const double high = node(base + kDown) * (1 - fx) + node(base + kRight + kDown) * fx;
  return 2 * (low * (1 - fy) + high * fy) - 1;
}

double fractal_noise(u64 seed, double x, double y, int octaves) {
  double sum = 0, weight = 0.5;
  for (int k = 0; k < octaves; ++k) {
    sum += weight * smooth_noise(seed + static_cast<u64>(k) * 0x51ed27u, x, y);
    x = 2 * x + 17.3;
    y = 2 * y + 5.9;
    weight *= 0.55;
  }
  return sum;
}

SurfaceLook look_at(const Material& m, double u, double v) {
  switch (m.texture) {
    case Texture::plain:
      break;
    case Texture::foil:
      return foil(m, u, v);
    case Texture::cells:
      return {cells(m, u, v), 0, 0};
    case Texture::bands:
      return {(floor_int(v / m.scale) & 1) != 0 ? m.second : m.albedo, 0, 0};
    case Texture::panels:
      return {panels(m, u, v), 0, 0};
    case Texture::racks:
      return {racks(m, u, v), 0, 0};
    case Texture::grain: {
      const double mix = 0.5 + 0.5 * fractal_noise(m.seed, u / m.scale, v / m.scale, 4);
      return {m.albedo + (m.second - m.albedo) * std::min(1.0, std::max(0.0, mix)), 0, 0};
    }
    case Texture::checks:
      return {((floor_int(u / m.scale) + floor_int(v / m.scale)) & 1) != 0 ? m.second : m.albedo, 0, 0};
    case Texture::tag: {
      const int side = m.pattern->side;
      const auto cell = [&](double x) {
        const auto i = static_cast<int>((x / m.scale + 1) * 0.5 * side);
        return std::min(side - 1, std::max(0, i));
      };
      // Rows go down where v goes up.
      return {m.pattern->cells[static_cast<std::size_t>(cell(-v) * side + cell(u))], 0, 0};
    }
  }
  return {m.albedo, 0, 0};
}

}  // namespace berth::navset
