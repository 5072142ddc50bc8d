#include "sim/scenario.hpp"

#include <cstdint>
#include <utility>

#include "berth/error.hpp"
#include "sim/board.hpp"
#include "sim/body.hpp"
#include "sim/clutter.hpp"
#include "sim/printed_marker.hpp"
#include "sim/printed_target.hpp"
#include "sim/render.hpp"
#include "sim/toml_reader.hpp"
#include "sim/trajectory.hpp"

namespace berth {
namespace sim {
namespace {

struct Timing {
  double rate_hz = 30, exposure_s = 0.002, readout_s = 0.003;
};

// A file's camera, or the paper's at another size, or one given field by field.
CameraModel read_camera(TomlReader& reader) {
  CameraModel camera;
  const std::string file = reader.text("file", "");
  const int width = reader.integer("width", 640, 16, 16384), height = reader.integer("height", 480, 16, 16384);
  if (!file.empty()) {
    for (const char* key : {"width", "height", "fx", "fy", "cx", "cy", "distortion"}) {
      if (reader.has(key)) reader.fail(key, "remove it, or remove 'file', which already says it");
    }
    return berth::read_camera(reader.beside(file));
  }
  if (!reader.has("fx") && !reader.has("fy")) {
    if (width * 3 != height * 4) reader.fail("height", "use a 4:3 image with the paper's lens, or give fx, fy, cx, cy");
    camera = paper_camera(width, height);
  }
  camera.width = width;
  camera.height = height;
  for (const char* key : {"fx", "fy", "cx", "cy"}) {
    if (reader.has("fx") && !reader.has(key)) reader.fail(key, "give all of fx, fy, cx, cy or none");
  }
  camera.fx = reader.number("fx", camera.fx, 1, 1e6);
  camera.fy = reader.number("fy", camera.fy, 1, 1e6);
  camera.cx = reader.number("cx", camera.cx, -1e5, 1e5);
  camera.cy = reader.number("cy", camera.cy, -1e5, 1e5);
  const auto& d = camera.distortion;
  const std::vector<double> read = reader.numbers("distortion", {d[0], d[1], d[2], d[3], d[4]}, -10, 10);
  for (std::size_t i = 0; i < 5; ++i) camera.distortion[i] = read[i];
  return camera;
}

Timing read_timing(TomlReader& reader) {
  Timing timing;
  timing.rate_hz = reader.number("frame_rate_hz", 30, 0.01, 10000);
  timing.exposure_s = reader.number("exposure_ms", 2, 0.001, 10000) / 1000;
  timing.readout_s = reader.number("readout_ms", 3, 0, 10000) / 1000;
  if (timing.exposure_s * timing.rate_hz > 1) {
    reader.fail("exposure_ms", "shorten it below the frame period, or lower frame_rate_hz");
  }
  return timing;
}

void read_sensor(TomlReader reader, Sensor& sensor) {
  sensor.vignetting = reader.number("vignetting", sensor.vignetting, 0, 1);
  sensor.blur_sigma_px = reader.number("blur_sigma_px", sensor.blur_sigma_px, 0, 20);
  sensor.defocus_px = reader.number("defocus_px", sensor.defocus_px, 0, 20);
  sensor.white_level = reader.number("white_level", sensor.white_level, 1, 4000);
  sensor.black_level = reader.number("black_level", sensor.black_level, 0, 200);
  sensor.full_well_e = reader.number("full_well_e", sensor.full_well_e, 100, 1e7);
  sensor.gamma = reader.number("gamma", sensor.gamma, 0.1, 5);
  sensor.read_noise = reader.number("read_noise", sensor.read_noise, 0, 60);
  if (sensor.white_level <= sensor.black_level) reader.fail("white_level", "raise it above black_level");
  reader.finish();
}

void read_lighting(TomlReader reader, Lighting& lighting) {
  lighting.ambient = reader.number("ambient", lighting.ambient, 0, 10);
  lighting.direct = reader.number("direct", lighting.direct, 0, 10);
  lighting.direction = reader.triple("direction", {0.3, -0.3, -1}, -100, 100);
  if (!(length(lighting.direction) > 1e-6)) reader.fail("direction", "give a vector towards the light, not zero");
  lighting.gradient = reader.pair("gradient", lighting.gradient, -5, 5);
  for (TomlReader& one : reader.tables("shadow")) {
    Shadow shadow;
    const double angle = radians(one.number("angle_deg", 0, -360, 360));
    shadow.normal = {exact_cos(angle), exact_sin(angle)};
    shadow.offset = one.number("offset", 0, -5, 5);
    shadow.softness = one.number("softness", shadow.softness, 0.002, 5);
    shadow.depth = one.number("depth", shadow.depth, 0, 1);
    one.finish();
    lighting.shadows.push_back(shadow);
  }
  for (TomlReader& one : reader.tables("glare")) {
    Glare glare;
    glare.center = one.pair("center", {0, 0}, -5, 5);
    glare.radius = one.number("radius", glare.radius, 0.002, 5);
    glare.strength = one.number("strength", glare.strength, 0, 100);
    one.finish();
    lighting.glares.push_back(glare);
  }
  reader.finish();
}

SceneMarker read_marker(TomlReader& reader) {
  SceneMarker marker;
  marker.family = reader.text("family", marker.family);
  const MarkerFamily* shape = nullptr;
  try {
    shape = &berth::family(marker.family);
  } catch (const Error& error) {
    reader.fail("family", error.what());
  }
  marker.id = reader.integer("id", 0, 0, static_cast<int>(shape->codes.size()) - 1);
  marker.size_m = reader.number("size_m", 0.1, 0.0005, 10);
  marker.pose = reader.pose();
  marker.margin_modules = reader.number("margin_modules", marker.margin_modules, 0, 20);
  marker.plate_m = reader.number("plate_m", marker.plate_m, 0, 5);
  marker.plate_albedo = reader.number("plate_albedo", marker.plate_albedo, 0, 1);
  marker.white = reader.number("white", marker.white, 0, 1);
  marker.black = reader.number("black", marker.black, 0, 1);
  if (marker.white <= marker.black) reader.fail("white", "make it lighter than black");
  reader.finish();
  return marker;
}

// Body, wall and markers in the body frame.
void read_target(TomlReader& reader, u64 seed, Scene& scene) {
  TomlReader wall = reader.table("background");
  TomlReader target = reader.table("target");
  Random random(seed);
  const bool has_wall = wall.boolean("wall", true);
  const double distance = wall.number("distance_m", 1.5, 0.1, 100);
  if (has_wall) {
    const double width = wall.number("width_m", 5, 0.1, 100), height = wall.number("height_m", 4, 0.1, 100);
    add_wall(scene.background, translation(0, 0, distance), width, height, wall.integer("items", 60, 0, 2000), random);
  }
  scene.void_albedo = wall.number("void_albedo", scene.void_albedo, 0, 1);
  wall.finish();

  BodyLook look;
  const bool body = target.boolean("body", true);
  look.width_m = target.number("width_m", look.width_m, 0.2, 20);
  look.height_m = target.number("height_m", look.height_m, 0.2, 20);
  look.depth_m = target.number("depth_m", look.depth_m, 0.25, 20);
  look.wings = target.boolean("wings", look.wings);
  look.ring = target.boolean("ring", look.ring);
  look.albedo = target.number("albedo", look.albedo, 0, 1);
  look.seed = random.bits();
  if (body && has_wall && look.depth_m >= distance) {
    target.fail("depth_m", "make the body shallower than background.distance_m, or move the wall away");
  }
  target.finish();
  if (body) add_body(scene.background, Pose{}, look);

  std::vector<TomlReader> markers = reader.tables("marker");
  for (TomlReader& one : markers) scene.markers.push_back(read_marker(one));
  std::vector<TomlReader> targets = reader.tables("disc_target");
  for (TomlReader& one : targets) scene.targets.push_back(read_scene_target(one));
  if (reader.has("board")) {
    for (Surface& surface : read_board(reader.table("board"))) scene.background.push_back(std::move(surface));
  } else if (markers.empty() && targets.empty()) {
    add_dock_markers(scene, Pose{});
  }

  for (TomlReader& one : reader.tables("finger")) {
    const Vec2 tip = one.pair("tip", {0.2, 0}, -5, 5);
    const double angle = radians(one.number("angle_deg", 0, -360, 360));
    const double width = one.number("width", 0.06, 0.002, 2), depth = one.number("depth_m", 0.16, 0.02, 20);
    add_finger(scene.foreground, tip, angle, width, depth, one.number("albedo", 0.2, 0, 1));
    one.finish();
  }
}

class ScenarioSource final : public Source {
 public:
  ScenarioSource(const std::string& path, Scene still, const Timing& timing, int frames,
                 std::unique_ptr<Trajectory> trajectory, int fineness)
      : name_(path.substr(path.find_last_of('/') + 1)),
        still_(std::move(still)),
        timing_(timing),
        frames_(frames),
        trajectory_(std::move(trajectory)),
        renderer_(still_.camera, fineness) {}

  std::optional<SourceFrame> next() override {
    if (next_ >= frames_) return std::nullopt;
    const int index = next_++;
    const Scene scene = scene_at(index);
    SourceFrame frame;
    frame.image = renderer_.render(scene);
    frame.truth = truth(scene);
    frame.truth_targets = truth_targets(scene);
    frame.label = name_ + "#" + std::to_string(index);
    const auto ns = [](double seconds) { return static_cast<std::int64_t>(floor_int(seconds * 1e9 + 0.5)); };
    frame.stamp.sequence = static_cast<u64>(index);
    frame.stamp.exposure_start_ns = ns(index / timing_.rate_hz);
    frame.stamp.mid_exposure_ns = frame.stamp.exposure_start_ns + ns(timing_.exposure_s / 2);
    frame.stamp.arrival_ns = frame.stamp.exposure_start_ns + ns(timing_.exposure_s + timing_.readout_s);
    frame.stamp.clock = "simulation";
    return frame;
  }
  std::optional<std::size_t> size() const override { return static_cast<std::size_t>(frames_); }
  std::optional<CameraModel> camera() const override { return still_.camera; }

 private:
  Pose body_at(double time_s) const {
    const double journey_s = frames_ > 1 ? (frames_ - 1) / timing_.rate_hz : 1;
    return trajectory_->body((time_s - timing_.exposure_s / 2) / journey_s, time_s);
  }

  Scene scene_at(int index) const {
    const double start_s = index / timing_.rate_hz;
    const Pose body = body_at(start_s + timing_.exposure_s / 2);
    Scene scene = still_;
    for (Surface& surface : scene.background) surface.pose = compose(body, surface.pose);
    for (SceneMarker& marker : scene.markers) marker.pose = compose(body, marker.pose);
    for (SceneTarget& target : scene.targets) target.pose = compose(body, target.pose);
    scene.motion = motion_between(body_at(start_s), body_at(start_s + timing_.exposure_s));
    scene.seed = scatter(still_.seed ^ scatter(static_cast<u64>(index)));
    return scene;
  }

  std::string name_;
  Scene still_;
  Timing timing_;
  int frames_;
  std::unique_ptr<Trajectory> trajectory_;
  Renderer renderer_;
  int next_ = 0;
};

}  // namespace
}  // namespace sim

std::unique_ptr<Source> open_scenario(const std::string& path) {
  using namespace sim;  // NOLINT(google-build-using-namespace): this is the simulator's door
  TomlReader reader = TomlReader::open(path);
  Scene scene;
  scene.seed = static_cast<u64>(reader.integer("seed", 1, 0, 2147483647));
  reader.text("title", "");

  TomlReader camera = reader.table("camera");
  scene.camera = read_camera(camera);
  const Timing timing = read_timing(camera);
  camera.finish();
  TomlReader sensor = reader.table("sensor");
  const int fineness = sensor.integer("blur_fineness", 1, 1, 8);
  read_sensor(std::move(sensor), scene.sensor);
  read_lighting(reader.table("lighting"), scene.lighting);
  read_target(reader, scene.seed, scene);

  TomlReader path_reader = reader.table("trajectory");
  const int frames = path_reader.integer("frames", 120, 1, 1000000);
  std::unique_ptr<Trajectory> trajectory = read_trajectory(path_reader, frames);
  path_reader.finish();
  reader.finish();
  return std::make_unique<ScenarioSource>(path, std::move(scene), timing, frames, std::move(trajectory), fineness);
}

}  // namespace berth
