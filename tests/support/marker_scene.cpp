#include "support/marker_scene.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace berth {
namespace {

void blur(std::vector<double>& image, int width, int height, double sigma) {
  if (!(sigma > 0)) return;
  const int reach = static_cast<int>(3 * sigma) + 1;
  std::vector<double> kernel;
  double total = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(std::exp(-i * i / (2 * sigma * sigma)));
    total += kernel.back();
  }
  const auto pass = [&](int step_x, int step_y) {
    const std::vector<double> from = image;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int i = -reach; i <= reach; ++i) {
          const int sx = std::min(width - 1, std::max(0, x + i * step_x));
          const int sy = std::min(height - 1, std::max(0, y + i * step_y));
          sum += kernel[static_cast<std::size_t>(i + reach)] * from[static_cast<std::size_t>(sy * width + sx)];
        }
        image[static_cast<std::size_t>(y * width + x)] = sum / total;
      }
    }
  };
  pass(1, 0);
  pass(0, 1);
}

}  // namespace

double Random::normal() {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += between(0, 1);
  return sum;
}

GrayImage draw_marker(const MarkerFamily& family, const std::vector<u8>& pattern, const Corners& corners, int width,
                      int height, const Look& look, Random& random) {
  QuadMap m;
  if (!m.set(corners, family.border_width, 3)) throw std::logic_error("no corners of a marker");
  // Adjugate of the map: image to marker.
  const double inverse[9] = {m.by - m.cy * m.hz,        m.cx * m.hz - m.bx,        m.bx * m.cy - m.cx * m.by,
                             m.cy * m.gz - m.ay,        m.ax - m.cx * m.gz,        m.cx * m.ay - m.ax * m.cy,
                             m.ay * m.hz - m.by * m.gz, m.bx * m.gz - m.ax * m.hz, m.ax * m.by - m.bx * m.ay};
  const int total = family.total_width;
  const int margin = (total - family.border_width) / 2;
  constexpr int kSamples = 4;
  std::vector<double> levels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const double px = x + (k % kSamples + 0.5) / kSamples - 0.5;
        const int row = k / kSamples;
        const double py = y + (row + 0.5) / kSamples - 0.5;
        const double z = inverse[6] * px + inverse[7] * py + inverse[8];
        const double u = (inverse[0] * px + inverse[1] * py + inverse[2]) / z + margin;
        const double v = (inverse[3] * px + inverse[4] * py + inverse[5]) / z + margin;
        const bool printed = u >= 0 && v >= 0 && u < total && v < total;
        const bool light =
            !printed || pattern[static_cast<std::size_t>(static_cast<int>(v) * total + static_cast<int>(u))] != 0;
        sum += light ? look.light : look.dark;
      }
      levels.push_back(sum / (kSamples * kSamples));
    }
  }
  blur(levels, width, height, look.blur_px);
  GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double level = levels[static_cast<std::size_t>(y * width + x)] + look.noise * random.normal();
      image.view().at(x, y) = static_cast<u8>(std::min(255.0, std::max(0.0, level + 0.5)));
    }
  }
  return image;
}

Corners random_corners(Random& random, double side_px, double tilt_deg, double x, double y) {
  const double depth = 8;  // in sides: a mild perspective
  const double pi = 3.14159265358979;
  const double axis = random.between(0, 2 * pi), roll = random.between(0, 2 * pi), tilt = tilt_deg * pi / 180;
  const double place[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const double a = std::cos(roll) * place[i][0] - std::sin(roll) * place[i][1];
    const double b = std::sin(roll) * place[i][0] + std::cos(roll) * place[i][1];
    const double scale = side_px * depth / (depth + std::sin(tilt) * b);
    const double c = std::cos(tilt) * b;
    corners[i] = {x + scale * (std::cos(axis) * a - std::sin(axis) * c),
                  y + scale * (std::sin(axis) * a + std::cos(axis) * c)};
  }
  return corners;
}

QuadCandidate candidate(const MarkerFamily& family, const Corners& corners, u32 first) {
  QuadCandidate quad;
  for (u32 i = 0; i < 4; ++i) quad.coarse[i] = corners[(first + i) & 3];
  quad.fine = quad.coarse;
  quad.reversed_border = family.reversed_border;
  return quad;
}

MarkerScene marker_scene(const MarkerFamily& family, const std::vector<u8>& pattern, double side_px, double tilt_deg,
                         const Look& look, Random& random) {
  const int size = static_cast<int>(side_px * 1.5 * family.total_width / family.border_width) + 16;
  const double middle = size / 2.0 + random.between(-0.5, 0.5);
  MarkerScene s;
  s.corners = random_corners(random, side_px, tilt_deg, middle, middle);
  s.image = draw_marker(family, pattern, s.corners, size, size, look, random);
  return s;
}

GrayImage texture(int size, double sigma, double contrast, Random& random) {
  std::vector<double> levels(static_cast<std::size_t>(size * size));
  for (double& level : levels) level = random.normal();
  blur(levels, size, size, sigma);
  double squares = 0;
  for (const double level : levels) squares += level * level;
  const double scale = contrast / std::sqrt(squares / static_cast<double>(levels.size()));
  GrayImage image(size, size);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double level = 128 + scale * levels[static_cast<std::size_t>(y * size + x)];
      image.view().at(x, y) = static_cast<u8>(std::min(255.0, std::max(0.0, level)));
    }
  }
  return image;
}

}  // namespace berth
