#include "sim/clutter.hpp"

#include <algorithm>

#include "sim/body.hpp"
#include "sim/printed_marker.hpp"

namespace berth::sim {
namespace {

Surface chequered(const Pose& at, double x, double y, double width, double height, int columns, int rows, double light,
                  double dark, Random* random) {
  Surface surface = flat(at, x, y, width, height, light);
  surface.columns = columns;
  surface.rows = rows;
  surface.cell_width = width / columns;
  surface.cell_height = height / rows;
  surface.left = -width / 2;
  surface.top = -height / 2;
  surface.cells.clear();
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const bool is_light = random != nullptr ? random->chance(0.5) : (r + c) % 2 == 0;
      surface.cells.push_back(is_light ? light : dark);
    }
  }
  return surface;
}

void add_rack(std::vector<Surface>& surfaces, const Pose& wall, double x, double y, double angle, Random& random) {
  const double width = random.uniform(0.3, 0.7), height = random.uniform(0.3, 0.8);
  const double ground = random.uniform(0.15, 0.6);
  Pose rack = compose(wall, translation(x, y, 0));
  rack.R = product(rack.R, rotation_z(angle));
  surfaces.push_back(flat(rack, 0, 0, width, height, ground));
  const int drawers = random.integer(2, 5);
  for (int i = 0; i < drawers; ++i) {
    const double top = height * ((i + 0.5) / drawers - 0.5);
    surfaces.push_back(flat(rack, 0, top, width * 0.9, height / drawers * 0.8, ground * random.uniform(0.5, 1.4)));
    if (random.chance(0.7)) surfaces.push_back(flat(rack, 0, top, width * 0.25, 0.02, random.uniform(0.05, 0.9)));
    if (random.chance(0.5)) {
      surfaces.push_back(lettering(rack, -width * 0.3, top, 0.03, random.integer(2, 5), 0.08, 0.8, random));
    }
  }
}

void add_item(std::vector<Surface>& surfaces, const Pose& wall, double x, double y, Random& random) {
  // Most things in a laboratory hang straight.
  const double angle = random.chance(0.6) ? radians(random.uniform(-3, 3)) : radians(random.uniform(0, 360));
  const double albedo = random.uniform(0.04, 0.85);
  switch (random.integer(0, 8)) {
    case 0:
      add_rack(surfaces, wall, x, y, radians(random.uniform(-4, 4)), random);
      break;
    case 1:
    case 2: {  // a cable or a pipe
      const double length = random.uniform(0.6, 3), width = random.uniform(0.008, 0.05);
      surfaces.push_back(turned(flat(wall, x, y, length, width, albedo), angle));
      break;
    }
    case 3: {
      const double height = random.uniform(0.03, 0.12);
      const int letters = random.integer(3, 12);
      const double ink = random.uniform(0.03, 0.2), ground = random.uniform(0.5, 0.85);
      surfaces.push_back(turned(lettering(wall, x, y, height, letters, ink, ground, random), angle));
      break;
    }
    case 4: {
      const double width = random.uniform(0.1, 0.4), height = random.uniform(0.1, 0.4);
      const int columns = random.integer(2, 9), rows = random.integer(2, 9);
      const double light = random.uniform(0.5, 0.85), dark = random.uniform(0.04, 0.3);
      Random* const shuffle = random.chance(0.5) ? &random : nullptr;
      surfaces.push_back(turned(chequered(wall, x, y, width, height, columns, rows, light, dark, shuffle), angle));
      break;
    }
    case 5: {
      const double radius = random.uniform(0.03, 0.25);
      surfaces.push_back(disc(wall, x, y, radius, random.chance(0.4) ? radius * random.uniform(0.5, 0.9) : 0, albedo));
      break;
    }
    case 6: {  // an odd-shaped board
      Surface board = flat(wall, x, y, 1, 1, albedo);
      const double size = random.uniform(0.1, 0.4);
      board.outline.clear();
      const int corners = random.integer(3, 7);
      for (int i = 0; i < corners; ++i) {
        const double a = 2 * kPi * (i + random.uniform(-0.2, 0.2)) / corners;
        board.outline.push_back({size * exact_cos(a), size * exact_sin(a)});
      }
      surfaces.push_back(board);
      break;
    }
    default: {  // a textured panel with a frame
      const double width = random.uniform(0.1, 0.7), height = random.uniform(0.1, 0.6);
      surfaces.push_back(turned(flat(wall, x, y, width + 0.02, height + 0.02, random.uniform(0.05, 0.8)), angle));
      Surface panel = flat(wall, x, y, width, height, albedo);
      panel.grain = random.uniform(0, 0.5);
      panel.grain_m = random.uniform(0.03, 0.2);
      panel.slope = {random.uniform(-1, 1), random.uniform(-1, 1)};
      surfaces.push_back(turned(panel, angle));
      break;
    }
  }
}

}  // namespace

void add_wall(std::vector<Surface>& surfaces, const Pose& wall, double width_m, double height_m, int items,
              Random& random) {
  Surface ground = flat(wall, 0, 0, 6 * width_m, 6 * height_m, random.uniform(0.12, 0.5));
  ground.grain = 0.25;
  ground.grain_m = random.uniform(0.1, 0.4);
  ground.slope = {random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15)};
  surfaces.push_back(ground);
  for (int i = 0; i < items; ++i) {
    const double x = width_m * random.uniform(-0.5, 0.5);
    const double y = height_m * random.uniform(-0.5, 0.5);
    add_item(surfaces, wall, x, y, random);
  }
}

int distance_to_family(const MarkerFamily& family, u64 code) {
  const std::size_t bits = family.bit_x.size();
  int nearest = static_cast<int>(bits);
  for (int turn = 0; turn < 4; ++turn) {
    for (const u64 word : family.codes) {
      u64 wrong = word ^ code;
      int distance = 0;
      for (; wrong != 0; wrong &= wrong - 1) ++distance;
      nearest = std::min(nearest, distance);
    }
    u64 next = 0;
    for (std::size_t i = 0; i < bits; ++i) {
      const u64 bit = (code >> (bits - 1 - i)) & 1;
      next |= bit << (bits - 1 - static_cast<std::size_t>(family.rotation[i]));
    }
    code = next;
  }
  return nearest;
}

u64 near_code(const MarkerFamily& family, int distance, Random& random) {
  const int bits = static_cast<int>(family.bit_x.size());
  for (;;) {
    u64 code = family.codes[static_cast<std::size_t>(random.integer(0, static_cast<int>(family.codes.size()) - 1))];
    for (int flipped = 0; flipped < distance + 2; ++flipped) code ^= u64{1} << random.integer(0, bits - 1);
    if (distance_to_family(family, code) >= distance) return code;
  }
}

void add_decoy(std::vector<Surface>& surfaces, const Pose& plane, const MarkerFamily& family, double size_m, int kind,
               Random& random) {
  const double white = random.uniform(0.7, 0.9), black = random.uniform(0.03, 0.12);
  const double module = size_m / family.border_width;
  if (kind == 0) {
    surfaces.push_back(pattern_surface(family, near_code(family, 5, random), size_m, plane, 0.5, white, black));
    return;
  }
  surfaces.push_back(flat(plane, 0, 0, size_m + 2 * module, size_m + 2 * module, white));
  switch (kind) {
    case 1: {
      const int cells = random.integer(5, 9);
      surfaces.push_back(chequered(plane, 0, 0, size_m, size_m, cells, cells, white, black, &random));
      break;
    }
    case 2:
      for (int i = 0; i < 4; ++i) {
        const double side = size_m - 2 * module * i;
        surfaces.push_back(flat(plane, 0, 0, side, side, i % 2 == 0 ? black : white));
      }
      break;
    case 3:
      surfaces.push_back(flat(plane, 0, 0, size_m, size_m, black));
      break;
    default:
      surfaces.push_back(flat(plane, 0, 0, size_m, size_m, black));
      for (double x : {-0.5, 0.5}) {
        for (double y : {-0.5, 0.5}) {
          const double pane = size_m * 0.36;
          surfaces.push_back(flat(plane, x * size_m * 0.44, y * size_m * 0.44, pane, pane, white));
        }
      }
      break;
  }
}

}  // namespace berth::sim
