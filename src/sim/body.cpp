#include "sim/body.hpp"

#include <algorithm>

#include "sim/printed_marker.hpp"

namespace berth::sim {
namespace {

// The plane frame of a box's side, from the body frame: columns x, y, z of the plane.
Pose face(const Pose& body, const Vec3& middle, const Vec3& x, const Vec3& y) {
  const Vec3 z = cross(x, y);
  Pose pose;
  pose.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
  pose.t = middle;
  return compose(body, pose);
}

void add_wing(std::vector<Surface>& surfaces, const Pose& body, double inner_m, double sign, double height_m) {
  const double width = 0.62, height = height_m, middle = sign * (inner_m + 0.07 + width / 2);
  const Pose plane = compose(body, translation(0, 0, 0.2));
  surfaces.push_back(flat(plane, sign * (inner_m + 0.05), 0, 0.14, 0.03, 0.5));
  surfaces.push_back(flat(plane, middle, 0, width + 0.02, height + 0.02, 0.62));
  Surface cells = flat(plane, middle, 0, width, height, 0.1);
  // Cells and the gaps between them, as every other column and row of the grid.
  constexpr int kColumns = 2 * 11 - 1, kRows = 2 * 6 - 1;
  cells.columns = kColumns;
  cells.rows = kRows;
  cells.cell_width = width / kColumns;
  cells.cell_height = height / kRows;
  cells.left = -width / 2;
  cells.top = -height / 2;
  cells.cells.clear();
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) cells.cells.push_back(c % 4 == 3 || r % 4 == 3 ? 0.24 : 0.10);
  }
  surfaces.push_back(cells);
}

void add_blanket(std::vector<Surface>& surfaces, const Pose& plane, double width, double height, double albedo,
                 Random& random) {
  Surface sheet = flat(plane, 0, 0, width, height, albedo);
  sheet.grain = 0.5;
  sheet.grain_m = 0.035;
  surfaces.push_back(sheet);
  // Seams and tape.
  for (int i = 1; i < 4; ++i) {
    const double x = width * (i / 4.0 - 0.5) + random.uniform(-0.01, 0.01);
    surfaces.push_back(flat(plane, x, 0, 0.004, height, albedo * 0.55));
  }
  surfaces.push_back(flat(plane, 0, height * random.uniform(-0.2, 0.2), width, 0.012, std::min(0.9, albedo * 1.4)));
}

void add_bolts(std::vector<Surface>& surfaces, const Pose& plane, double width, double height, double step) {
  const auto bolt = [&](double x, double y) {
    surfaces.push_back(disc(plane, x, y, 0.0045, 0, 0.2));
    surfaces.push_back(disc(plane, x - 0.0006, y - 0.0006, 0.0031, 0, 0.66));
  };
  const int across = std::max(1, static_cast<int>(width / step)), down = std::max(1, static_cast<int>(height / step));
  for (int i = 0; i <= across; ++i) {
    bolt(width * (static_cast<double>(i) / across - 0.5), -height / 2);
    bolt(width * (static_cast<double>(i) / across - 0.5), height / 2);
  }
  for (int i = 1; i < down; ++i) {
    bolt(-width / 2, height * (static_cast<double>(i) / down - 0.5));
    bolt(width / 2, height * (static_cast<double>(i) / down - 0.5));
  }
}

void add_thruster(std::vector<Surface>& surfaces, const Pose& plane, double x, double y) {
  surfaces.push_back(disc(plane, x, y, 0.019, 0, 0.55));
  surfaces.push_back(disc(plane, x, y, 0.0165, 0, 0.22));
  surfaces.push_back(disc(plane, x + 0.001, y + 0.001, 0.011, 0, 0.04));
}

// A bar on two feet, 30 mm proud of the front, with its shadow on the sheet.
void add_handrail(std::vector<Surface>& surfaces, const Pose& body, double x, double y, double length) {
  surfaces.push_back(flat(body, x + 0.006, y + 0.008, 0.012, length, 0.16));
  const Pose proud = compose(body, translation(0, 0, -0.03));
  for (double end : {-0.5, 0.5}) surfaces.push_back(flat(proud, x, y + end * length, 0.02, 0.016, 0.5));
  surfaces.push_back(flat(proud, x, y, 0.011, length, 0.7));
  surfaces.push_back(flat(proud, x - 0.003, y, 0.003, length, 0.92));
}

void add_front(std::vector<Surface>& surfaces, const Pose& body, const BodyLook& look, Random& random) {
  const double w = look.width_m, h = look.height_m;
  surfaces.push_back(flat(body, 0, 0, w, h, 0.68));
  surfaces.push_back(flat(body, 0, 0, w - 0.012, h - 0.012, 0.2));
  Surface sheet = flat(body, 0, 0, w - 0.018, h - 0.018, look.albedo);
  sheet.grain = 0.10;
  sheet.grain_m = 0.03;
  sheet.slope = {random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6)};
  surfaces.push_back(sheet);
  add_bolts(surfaces, body, w - 0.04, h - 0.04, 0.06);
  if (look.ring) {
    const double radius = 0.42 * h;
    surfaces.push_back(disc(body, 0, 0, radius, radius - 0.022, 0.24));
    surfaces.push_back(disc(body, 0, 0, radius - 0.002, radius - 0.019, 0.72));
    surfaces.push_back(disc(body, 0, 0, radius - 0.008, radius - 0.011, 0.35));
    for (int i = 0; i < 12; ++i) {
      const double angle = kPi / 6 * i + 0.26;
      surfaces.push_back(
          disc(body, (radius - 0.0145) * exact_cos(angle), (radius - 0.0145) * exact_sin(angle), 0.003, 0, 0.15));
    }
  }
  // Panel joints, and the hatch that the markers' board replaces.
  surfaces.push_back(flat(body, 0, 0, w * 0.62, h * 0.58, 0.3));
  surfaces.push_back(flat(body, 0, 0, w * 0.62 - 0.004, h * 0.58 - 0.004, look.albedo * 1.1));
  for (double x : {-0.5, 0.5}) {
    for (double y : {-0.5, 0.5}) add_thruster(surfaces, body, x * (w - 0.1), y * (h - 0.1));
  }
  surfaces.push_back(lettering(body, 0, h * 0.5 - 0.042, 0.016, 9, 0.08, look.albedo * 1.05, random));
  surfaces.push_back(lettering(body, -w * 0.28, -h * 0.5 + 0.042, 0.011, 6, 0.85, 0.12, random));
  surfaces.push_back(lettering(body, w * 0.26, -h * 0.5 + 0.042, 0.008, 12, 0.1, 0.7, random));
  // Hazard stripes by the rim.
  Surface stripes = flat(body, 0, -h * 0.5 + 0.018, w * 0.3, 0.01, 0.75);
  stripes.columns = 15;
  stripes.left = -w * 0.15;
  stripes.cell_width = w * 0.02;
  stripes.cell_height = 1;
  stripes.top = -0.5;
  stripes.cells.clear();
  for (int i = 0; i < 15; ++i) stripes.cells.push_back(i % 2 == 0 ? 0.08 : 0.66);
  surfaces.push_back(stripes);
  add_handrail(surfaces, body, -w * 0.5 + 0.055, 0, h * 0.4);
  add_handrail(surfaces, body, w * 0.5 - 0.055, 0, h * 0.4);
}

}  // namespace

Surface flat(const Pose& at, double x, double y, double width, double height, double albedo) {
  Surface surface;
  surface.pose = compose(at, translation(x, y, 0));
  surface.outline = rectangle(width, height);
  surface.cells = {albedo};
  return surface;
}

Surface turned(Surface surface, double angle_rad) {
  surface.pose.R = product(surface.pose.R, rotation_z(angle_rad));
  return surface;
}

Surface disc(const Pose& at, double x, double y, double outer, double inner, double albedo) {
  Surface surface;
  surface.pose = compose(at, translation(x, y, 0));
  surface.outer_radius = outer;
  surface.inner_radius = inner;
  surface.cells = {albedo};
  return surface;
}

Surface lettering(const Pose& at, double x, double y, double height, int letters, double ink, double ground,
                  Random& random) {
  constexpr int kLetterWidth = 3, kRows = 7;
  const int columns = letters * (kLetterWidth + 1) + 1;
  const double cell = height / kRows;
  Surface surface = flat(at, x, y, columns * cell, height, ground);
  surface.columns = columns;
  surface.rows = kRows;
  surface.cell_width = surface.cell_height = cell;
  surface.left = -0.5 * columns * cell;
  surface.top = -0.5 * height;
  surface.cells.assign(static_cast<std::size_t>(columns * kRows), ground);
  for (int letter = 0; letter < letters; ++letter) {
    const u64 strokes = random.bits();
    for (int r = 1; r < kRows - 1; ++r) {
      for (int c = 0; c < kLetterWidth; ++c) {
        // Left strokes are common, as in our alphabet.
        const bool inked = ((strokes >> (r * kLetterWidth + c)) & 1) != 0 || (c == 0 && (strokes >> 60) < 11);
        const int column = letter * (kLetterWidth + 1) + 1 + c;
        if (inked) surface.cells[static_cast<std::size_t>(r * columns + column)] = ink;
      }
    }
  }
  return surface;
}

void add_body(std::vector<Surface>& surfaces, const Pose& body, const BodyLook& look) {
  Random random(look.seed);
  const double w = look.width_m, h = look.height_m, d = look.depth_m;
  if (look.wings) {
    add_wing(surfaces, body, w / 2, -1, h * 0.8);
    add_wing(surfaces, body, w / 2, 1, h * 0.8);
  }
  const Vec3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
  const double gold = 0.34;
  add_blanket(surfaces, face(body, {w / 2, 0, d / 2}, z, y), d, h, gold, random);
  add_blanket(surfaces, face(body, {-w / 2, 0, d / 2}, scaled(z, -1), y), d, h, gold, random);
  add_blanket(surfaces, face(body, {0, -h / 2, d / 2}, x, scaled(z, -1)), w, d, gold, random);
  add_blanket(surfaces, face(body, {0, h / 2, d / 2}, x, z), w, d, gold, random);
  add_front(surfaces, body, look, random);
}

void add_dock_markers(Scene& scene, const Pose& body) {
  const auto place = [&](int id, double size, double x, double y, double plate) {
    SceneMarker marker;
    marker.id = id;
    marker.size_m = size;
    marker.pose = compose(body, translation(x, y, 0));
    marker.margin_modules = 0.25;
    marker.plate_m = plate;
    marker.plate_albedo = 0.3;
    scene.markers.push_back(marker);
  };
  place(0, 0.1, 0, 0, 0.003);
  place(1, 0.03, -0.09, -0.055, 0.002);
  place(2, 0.03, -0.09, 0.055, 0.002);
  place(3, 0.03, 0.09, 0.055, 0.002);
  place(4, 0.03, 0.09, -0.055, 0.002);
}

void add_finger(std::vector<Surface>& surfaces, const Vec2& tip, double angle_rad, double width, double depth_m,
                double albedo) {
  Pose plane = translation(tip[0] * depth_m, tip[1] * depth_m, depth_m);
  plane.R = rotation_z(angle_rad);
  const double w = width * depth_m, reach = 3 * depth_m;
  // Towards +x: out of the view.
  Surface bar = flat(plane, 0, 0, 1, 1, albedo);
  bar.outline = {{0, -0.28 * w},   {0.5 * w, -0.5 * w}, {reach, -0.5 * w},
                 {reach, 0.5 * w}, {0.5 * w, 0.5 * w},  {0, 0.28 * w}};
  bar.grain = 0.08;
  bar.grain_m = 0.3 * w;
  surfaces.push_back(bar);
  Surface edge = bar;
  edge.outline = {{0.5 * w, -0.5 * w}, {reach, -0.5 * w}, {reach, -0.38 * w}, {0.5 * w, -0.38 * w}};
  edge.cells = {std::min(0.9, albedo * 1.8 + 0.05)};
  surfaces.push_back(edge);
  Surface pad = bar;
  pad.outline = {{0.06 * w, -0.2 * w}, {0.5 * w, -0.32 * w}, {0.5 * w, 0.32 * w}, {0.06 * w, 0.2 * w}};
  pad.cells = {0.06};
  surfaces.push_back(pad);
  for (int i = 0; i < 3; ++i) surfaces.push_back(disc(plane, (0.9 + 0.8 * i) * w, 0, 0.12 * w, 0, albedo * 0.4));
}

}  // namespace berth::sim
