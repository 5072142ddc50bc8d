#include "sim/printed_target.hpp"

#include <algorithm>
#include <cmath>

#include "berth/error.hpp"
#include "sim/printed_marker.hpp"
#include "sim/toml_reader.hpp"

namespace berth::sim {
namespace {

/// The smallest rectangle about everything that is printed, along the target's axes.
struct Box {
  Vec2 low = {1e9, 1e9}, high = {-1e9, -1e9};

  void add(double x, double y, double reach) {
    low = {std::min(low[0], x - reach), std::min(low[1], y - reach)};
    high = {std::max(high[0], x + reach), std::max(high[1], y + reach)};
  }
};

Box box_of(const DiscTarget& target) {
  Box box;
  for (const TargetDisc& disc : target.discs) box.add(disc.x_m, disc.y_m, disc.diameter_m / 2);
  for (const TargetBar& bar : target.bars) {
    box.add(bar.from_m[0], bar.from_m[1], bar.width_m / 2);
    box.add(bar.to_m[0], bar.to_m[1], bar.width_m / 2);
  }
  return box;
}

Surface plain(const Pose& pose, double albedo) {
  Surface surface;
  surface.pose = pose;
  surface.cells = {albedo};
  surface.fine = true;
  return surface;
}

}  // namespace

std::vector<Surface> target_surfaces(const SceneTarget& scene) {
  const DiscTarget& target = scene.target;
  const Box box = box_of(target);
  std::vector<Surface> surfaces;
  Surface plate = plain(
      compose(scene.pose, translation((box.low[0] + box.high[0]) / 2, (box.low[1] + box.high[1]) / 2, 0)), scene.white);
  plate.outline =
      rectangle(box.high[0] - box.low[0] + 2 * scene.margin_m, box.high[1] - box.low[1] + 2 * scene.margin_m);
  surfaces.push_back(plate);
  for (const TargetBar& bar : target.bars) {
    const double dx = bar.to_m[0] - bar.from_m[0], dy = bar.to_m[1] - bar.from_m[1];
    const double long_m = std::sqrt(dx * dx + dy * dy);
    Pose along = translation((bar.from_m[0] + bar.to_m[0]) / 2, (bar.from_m[1] + bar.to_m[1]) / 2, 0);
    along.R = {dx / long_m, -dy / long_m, 0, dy / long_m, dx / long_m, 0, 0, 0, 1};
    Surface surface = plain(compose(scene.pose, along), scene.black);
    surface.outline = rectangle(long_m, bar.width_m);
    surfaces.push_back(surface);
  }
  for (const TargetDisc& disc : target.discs) {
    Surface surface = plain(compose(scene.pose, translation(disc.x_m, disc.y_m, 0)), scene.black);
    surface.outer_radius = disc.diameter_m / 2;
    surface.inner_radius = disc.hole_m / 2;
    surfaces.push_back(surface);
  }
  return surfaces;
}

SceneTarget read_scene_target(TomlReader& reader) {
  SceneTarget scene;
  const std::string file = reader.text("file", "");
  if (file.empty()) reader.fail("file", "name the target's file, e.g. \"../targets/port.yaml\"");
  scene.target = read_disc_target(reader.beside(file));
  scene.pose = reader.pose();
  scene.margin_m = reader.number("margin_m", scene.margin_m, 0, 5);
  scene.white = reader.number("white", scene.white, 0, 1);
  scene.black = reader.number("black", scene.black, 0, 1);
  if (scene.white <= scene.black) reader.fail("white", "make it lighter than black");
  reader.finish();
  return scene;
}

}  // namespace berth::sim
