#include "support/pictures.hpp"

#include <algorithm>

namespace berth::pictures {

u64 Random::next() {
  u64 z = (state_ += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

GrayImage uniform(int width, int height, u8 level) { return noise(width, height, {level}, 1); }

GrayImage noise(int width, int height, const std::vector<u8>& levels, u64 seed) {
  Random random(seed);
  GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.view().at(x, y) = levels[static_cast<std::size_t>(random.below(static_cast<int>(levels.size())))];
    }
  }
  return image;
}

GrayImage checkerboard(int width, int height, int cell) {
  GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.view().at(x, y) = (x / cell + y / cell) % 2 == 0 ? 40 : 200;
  }
  return image;
}

GrayImage hollow_squares(int width, int height, int count) {
  constexpr int kCellWidth = 20, kCellHeight = 19, kFrom = 3, kSide = 13, kHole = 4;
  GrayImage image = uniform(width, height, 190);
  const int columns = width / kCellWidth;
  for (int i = 0; i < std::min(count, columns * (height / kCellHeight)); ++i) {
    const int left = i % columns * kCellWidth + kFrom, top = i / columns * kCellHeight + kFrom;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const bool inside = std::min({x, y, kSide - 1 - x, kSide - 1 - y}) >= kHole;
        image.view().at(left + x, top + y) = inside ? 180 : 40;
      }
    }
  }
  return image;
}

namespace {

struct Corner {
  int x, y;
};

/// Whether (x, y) lies inside the clockwise quadrilateral.
bool inside(const Corner (&corners)[4], int x, int y) {
  for (int k = 0; k < 4; ++k) {
    const Corner a = corners[k];
    const Corner b = corners[(k + 1) % 4];
    if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) < 0) return false;
  }
  return true;
}

}  // namespace

GrayImage quads(int width, int height, int count, int spread, u64 seed) {
  Random random(seed);
  GrayImage image = uniform(width, height, 190);
  for (int i = 0; i < count; ++i) {
    const int size = 8 + random.below(std::max(1, std::min(width, height) / 3));
    const Corner center{random.below(width), random.below(height)};
    Corner outer[4];
    Corner inner[4];
    const int lean = random.below(2 * size + 1) - size;
    const Corner axes[4] = {{-size, -size}, {size, -size}, {size, size}, {-size, size}};
    for (int k = 0; k < 4; ++k) {
      // A turned and sheared square with its corners jittered by an eighth.
      const int x = axes[k].x - axes[k].y * lean / (2 * size) + random.below(size / 4 + 1);
      const int y = axes[k].y + axes[k].x * lean / (2 * size) + random.below(size / 4 + 1);
      outer[k] = {center.x + x, center.y + y};
      inner[k] = {center.x + x / 2, center.y + y / 2};
    }
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (inside(outer, x, y)) image.view().at(x, y) = inside(inner, x, y) ? 170 : 45;
      }
    }
  }
  for (int y = 0; y < height && spread > 0; ++y) {
    for (int x = 0; x < width; ++x) {
      u8& pixel = image.view().at(x, y);
      pixel = static_cast<u8>(pixel + random.below(2 * spread + 1) - spread);
    }
  }
  return image;
}

GrayImage mazes(int width, int height, u64 seed) {
  Random random(seed);
  GrayImage image = uniform(width, height, 210);
  for (int i = 0; i < 40; ++i) {
    const int w = 3 + random.below(std::max(1, width / 2));
    const int h = 3 + random.below(std::max(1, height / 2));
    const int x0 = random.below(width);
    const int y0 = random.below(height);
    const int step = 1 + random.below(4);
    const int kind = random.below(3);
    for (int y = y0; y < std::min(height, y0 + h); ++y) {
      for (int x = x0; x < std::min(width, x0 + w); ++x) {
        const int ring = std::min(std::min(x - x0, y - y0), std::min(x0 + w - 1 - x, y0 + h - 1 - y));
        const bool dark = kind == 0   ? ring / step % 2 == 0                       // nested frames
                          : kind == 1 ? y - y0 < step || (x - x0) / step % 2 == 0  // a comb
                                      : (x - x0 + y - y0) / step % 2 == 0;         // stairs
        image.view().at(x, y) = dark ? 30 : 210;
      }
    }
  }
  return image;
}

}  // namespace berth::pictures
