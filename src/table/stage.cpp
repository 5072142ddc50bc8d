#include "table/stage.hpp"

#include "sim/body.hpp"
#include "sim/geometry.hpp"

namespace berth::table {
namespace {

constexpr double kWall_m = 3;
constexpr double kWallSide_m = 20;
constexpr double kWallAlbedo = 0.4;

}  // namespace

StageFrame Stage::look(const Stop& stop, u64 seed) const {
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
  return {renderer_.render(scene), sim::truth(scene).front()};
}

}  // namespace berth::table
