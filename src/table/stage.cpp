#include "table/stage.hpp"

#include "sim/body.hpp"
#include "sim/geometry.hpp"

namespace berth::table {
namespace {

constexpr double kWall_m = 3;
constexpr double kWallSide_m = 20;
constexpr double kWallAlbedo = 0.4;

}  // namespace

sim::Scene Stage::scene(const Stop& stop, u64 seed) const {
  sim::Scene scene;
  scene.camera = camera();
  scene.sensor = sensor_;
  scene.seed = seed;
  scene.background.push_back(sim::flat(sim::translation(0, 0, kWall_m), 0, 0, kWallSide_m, kWallSide_m, kWallAlbedo));
  sim::SceneMarker marker;
  marker.family = kFamily;
  marker.id = kMarker;
  marker.size_m = stop.size_m;
  marker.pose = stop.truth;
  scene.markers.push_back(marker);
  return scene;
}

StageFrame Stage::look(const Stop& stop, u64 seed) const {
  const sim::Scene shown = scene(stop, seed);
  return {renderer_.render(shown), sim::truth(shown).front(), corner_information(shown)};
}

}  // namespace berth::table
