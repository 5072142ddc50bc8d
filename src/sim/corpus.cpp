#include "sim/corpus.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "berth/error.hpp"
#include "sim/body.hpp"
#include "sim/clutter.hpp"
#include "sim/printed_marker.hpp"

namespace berth::sim {
namespace {

constexpr double kTag_m = 0.1;

struct Range {
  double low, high;
  double draw(Random& random) const { return random.uniform(low, high); }
  // As many below the geometric mean as above.
  double draw_ratio(Random& random) const { return low * exact_pow(high / low, random.uniform(0, 1)); }
};

// A marker's place in the image: nothing else may come within `radius` of the point.
struct Place {
  Vec2 pixel;
  double radius;
};

// Builds one frame. Draws everything from one sequence, so the order of the draws is part of the corpus: never two in
// the arguments of one call, which compilers evaluate in different orders (braces and statements keep theirs).
class Frame {
 public:
  Frame(u64 seed, const CameraModel& camera) : random(seed) {
    scene.camera = camera;
    scene.seed = scatter(seed);
  }

  /// The paper's room: a wall with things on it, sometimes a satellite on the way.
  void room(int items, double body_chance) {
    const double depth = random.uniform(2.2, 4.0);
    const double aspect = static_cast<double>(scene.camera.height) / scene.camera.width;
    Pose wall = translation(0, 0, depth);
    wall.R = turn({12, 18, 8});
    const double width = 1.15 * depth * scene.camera.width / scene.camera.fx;
    add_wall(scene.background, wall, width, width * aspect, items, random);
    if (random.chance(body_chance)) {
      Pose body;
      body.t = {random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4), random.uniform(1.4, 2.1)};
      body.R = turn({40, 40, 180});
      BodyLook look;
      look.seed = random.bits();
      look.albedo = random.uniform(0.25, 0.6);
      look.ring = random.chance(0.6);
      add_body(scene.background, body, look);
    }
  }

  /// A rotation by up to ± these angles about x, y and z.
  Mat3 turn(const Vec3& most_deg) {
    Vec3 angles{};
    for (std::size_t i = 0; i < 3; ++i) angles[i] = radians(random.uniform(-most_deg[i], most_deg[i]));
    return rotation(angles[0], angles[1], angles[2]);
  }

  void light(Range ambient) {
    Lighting& light = scene.lighting;
    light.ambient = ambient.draw(random);
    light.direct = 1 - light.ambient;
    light.direction = {random.uniform(-0.7, 0.7), random.uniform(-0.8, 0.4), -1};
    light.gradient = {random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4)};
    scene.sensor.blur_sigma_px = random.uniform(0.6, 0.9);
    scene.sensor.white_level = random.uniform(170, 240);
  }

  void shadow() {
    Shadow shadow;
    const double angle = random.uniform(0, 2 * kPi);
    shadow.normal = {exact_cos(angle), exact_sin(angle)};
    shadow.offset = random.uniform(-0.2, 0.2);
    shadow.softness = random.uniform(0.004, 0.08);
    shadow.depth = random.uniform(0.4, 0.9);
    scene.lighting.shadows.push_back(shadow);
  }

  void glare(Range strength) {
    Glare glare;
    glare.center = {random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3)};
    glare.radius = random.uniform(0.03, 0.2);
    glare.strength = strength.draw(random);
    scene.lighting.glares.push_back(glare);
  }

  /// A plane whose middle is at a free place of the image, `side_px` wide for a square of kTag_m seen frontally, tilted
  /// by `tilt_deg` about a random axis and turned at random. `spread` is the radius to keep free over half the
  /// side. Returns false when no place is found.
  bool plane(double side_px, Range tilt_deg, double spread, Pose& pose) {
    const CameraModel& camera = scene.camera;
    const double radius = 0.5 * spread * side_px + 3;
    const double tilt = radians(tilt_deg.draw(random)), axis = random.uniform(0, 2 * kPi);
    const double roll = random.uniform(0, 2 * kPi);
    for (int attempt = 0; attempt < 200; ++attempt) {
      const double x = random.uniform(0, 1), y = random.uniform(0, 1);
      if (2 * radius > camera.width || 2 * radius > camera.height) return false;
      const Vec2 pixel = {radius + x * (camera.width - 2 * radius), radius + y * (camera.height - 2 * radius)};
      const auto clash = [&](const Place& p) {
        const double dx = p.pixel[0] - pixel[0], dy = p.pixel[1] - pixel[1], d = p.radius + radius;
        return dx * dx + dy * dy < d * d;
      };
      if (std::any_of(places_.begin(), places_.end(), clash)) continue;
      places_.push_back({pixel, radius});
      const double depth = camera.fx * kTag_m / side_px;
      const Vec3 ray = {(pixel[0] - camera.cx) / camera.fx, (pixel[1] - camera.cy) / camera.fy, 1};
      const Vec3 z = normalized(ray), across = normalized(cross({0, 1, 0}, z)), down = cross(z, across);
      const Mat3 look = {across[0], down[0], z[0], across[1], down[1], z[1], across[2], down[2], z[2]};
      const Mat3 lean = product(rotation_z(axis), product(rotation_x(tilt), rotation_z(roll - axis)));
      pose.R = product(look, lean);
      pose.t = scaled(ray, depth);
      return true;
    }
    return false;
  }

  void marker(const Pose& plane, const std::string& family, int id) {
    SceneMarker marker;
    marker.family = family;
    marker.id = id;
    marker.size_m = kTag_m;
    marker.pose = plane;
    marker.margin_modules = random.uniform(0, 0.8);
    marker.plate_m = random.chance(0.7) ? random.uniform(0.002, 0.02) : 0;
    marker.plate_albedo = random.uniform(0.08, 0.8);
    marker.white = random.uniform(0.75, 0.92);
    marker.black = random.uniform(0.03, 0.09);
    scene.markers.push_back(marker);
  }

  /// A marker of tag36h11 somewhere free; the id differs between the `place` of each of `count` calls.
  void free_marker(Range side_px, Range tilt_deg, int place, int count) {
    const double side = side_px.draw_ratio(random);
    const int id = random.integer(0, 586 / count - 1) * count + place;
    Pose pose;
    // The pattern's half diagonal over half the border's side, with margin and plate.
    if (plane(side, tilt_deg, 2.2, pose)) marker(pose, "tag36h11", id);
  }
  void free_markers(int count, Range side_px, double tilt_deg) {
    for (int i = 0; i < count; ++i) free_marker(side_px, {0, tilt_deg}, i, count);
  }

  /// A marker on the front of a satellite, with the room behind.
  void on_body(Range side_px, double tilt_deg) {
    const double side = std::min(side_px.draw(random), 0.44 * scene.camera.height);
    const int id = random.integer(0, 586);
    Pose pose;
    if (!plane(side, {0, tilt_deg}, 1.9, pose)) throw Error("simulator: the image is too small for the corpus");
    BodyLook look;
    look.seed = random.bits();
    look.albedo = random.uniform(0.2, 0.65);
    look.ring = random.chance(0.6);
    look.width_m = random.uniform(0.38, 0.56);
    look.height_m = random.uniform(0.36, 0.46);
    const Vec2 off = {random.uniform(-0.04, 0.04), random.uniform(-0.04, 0.04)};
    add_body(scene.background, compose(pose, translation(off[0], off[1], 0)), look);
    marker(pose, "tag36h11", id);
  }

  void fingers(int count) {
    for (int i = 0; i < count; ++i) {
      // Near a marker's rim as often as anywhere: a gripper is where the work is.
      Vec2 tip = {random.uniform(-0.35, 0.35), random.uniform(-0.28, 0.28)};
      if (random.chance(0.6) && !scene.markers.empty()) {
        const SceneMarker& m =
            scene.markers[static_cast<std::size_t>(random.integer(0, static_cast<int>(scene.markers.size()) - 1))];
        const double reach = kTag_m / m.pose.t[2];
        tip = {m.pose.t[0] / m.pose.t[2] + reach * random.uniform(-0.9, 0.9),
               m.pose.t[1] / m.pose.t[2] + reach * random.uniform(-0.9, 0.9)};
      }
      // From the outside in.
      const double outward = tip[0] >= 0 ? 0 : kPi;
      const double angle = outward + radians(random.uniform(-70, 70));
      const double width = random.uniform(0.03, 0.08), albedo = random.uniform(0.08, 0.45);
      add_finger(scene.foreground, tip, angle, width, 0.16, albedo);
    }
  }

  Scene scene;
  Random random;

 private:
  std::vector<Place> places_;
};

void easy(Frame& f, int /*index*/) {
  f.room(24, 0);
  f.light({0.3, 0.5});
  f.on_body({60, 220}, 45);
}

void dock(Frame& f, int index) {
  // Closing at an even speed, with the sway of a free-floating robot.
  const double s = static_cast<double>(index % kCorpusFrames) / (kCorpusFrames - 1);
  const double range = 1.6 + s * (0.18 - 1.6);
  f.room(30, 0);
  f.light({0.35, 0.5});
  f.scene.sensor.white_level = f.random.uniform(190, 225);
  Pose body;
  body.t = {0.07 * range * f.random.uniform(-1, 1), 0.05 * range * f.random.uniform(-1, 1), range};
  body.R = f.turn({8, 8, 12});
  BodyLook look;
  look.seed = 3;
  add_body(f.scene.background, body, look);
  add_dock_markers(f.scene, body);
}

void hard(Frame& f, int /*index*/) {
  f.room(34, 0.6);
  f.light({0.1, 0.4});
  f.scene.sensor.blur_sigma_px = f.random.uniform(0.6, 1.5);
  f.scene.sensor.read_noise = f.random.uniform(1.5, 3.7);
  f.scene.sensor.gamma = f.random.uniform(0.55, 1.7);
  f.scene.sensor.white_level = f.random.uniform(70, 250);
  if (f.random.chance(0.6)) f.shadow();
  if (f.random.chance(0.3)) f.shadow();
  if (f.random.chance(0.5)) f.glare({0.2, 1.2});
  // Directions spread over the sphere lean more often than not.
  const int count = f.random.integer(1, 4);
  for (int i = 0; i < count; ++i) {
    const double tilt = 72 * std::sqrt(f.random.uniform(0, 1));
    f.free_marker({26, 200}, {tilt, tilt}, i, count);
  }
  if (f.random.chance(0.6)) f.fingers(f.random.integer(1, 3));
}

void tiny(Frame& f, int /*index*/) {
  f.room(26, 0.7);
  f.light({0.3, 0.5});
  f.free_markers(8, {12, 34}, 40);
}

void cluttered(Frame& f, int index) {
  const MarkerFamily& shape = berth::family("tag36h11");
  f.room(60, 0.5);
  f.light({0.25, 0.5});
  static const char* const kOthers[] = {"tag25h9",     "tag16h5",      "tagStandard41h12", "tagCircle21h7",
                                        "aruco5x5_50", "aruco6x6_250", "tagCustom48h12"};
  if (index % 10 != 3) f.free_markers(f.random.integer(1, 2), {40, 130}, 50);
  const int others = f.random.integer(2, 4);
  for (int i = 0; i < others; ++i) {
    const char* name = kOthers[f.random.integer(0, 6)];
    const int id = f.random.integer(0, std::min<int>(19, static_cast<int>(berth::family(name).codes.size()) - 1));
    Pose pose;
    if (f.plane(f.random.uniform(30, 90), {0, 45}, 2.6, pose)) f.marker(pose, name, id);
  }
  const int decoys = f.random.integer(4, 7);
  for (int i = 0; i < decoys; ++i) {
    const int kind = f.random.chance(0.5) ? 0 : f.random.integer(1, kDecoyKinds - 1);
    Pose pose;
    if (f.plane(f.random.uniform(30, 90), {0, 45}, 2, pose)) {
      add_decoy(f.scene.background, pose, shape, kTag_m, kind, f.random);
    }
  }
}

void dark(Frame& f, int /*index*/) {
  f.room(26, 0);
  f.light({0.3, 0.5});
  f.on_body({50, 180}, 45);
  f.scene.sensor.black_level = 3;
  f.scene.sensor.white_level = f.random.uniform(12, 60);
}

void motion(Frame& f, int /*index*/) {
  f.room(26, 0);
  f.light({0.3, 0.5});
  const double blur = f.random.uniform(1, 12), angle = f.random.uniform(0, 2 * kPi);
  // Modules stay wider than the blur: what a blur wider than a module leaves, nothing can read.
  f.on_body({std::max(60.0, 10 * blur), 220}, 45);
  // Turning by θ moves the image by f·θ, and the view's middle a little less than its rim.
  f.scene.motion.turn = {blur * exact_sin(angle) / f.scene.camera.fy, blur * exact_cos(angle) / f.scene.camera.fx, 0};
}

struct Corpus {
  const char* name;
  void (*build)(Frame&, int);
};
constexpr Corpus kCorpora[] = {{"easy", easy},           {"dock", dock}, {"hard", hard},    {"tiny", tiny},
                               {"cluttered", cluttered}, {"dark", dark}, {"motion", motion}};

CameraModel corpus_camera(int width, int height) {
  // The paper's lens, cut at the top and bottom where the image is not 4:3.
  CameraModel camera = paper_camera(1280, 960);
  const double scale = width / 1280.0;
  camera.fx *= scale;
  camera.fy *= scale;
  camera.cx = (camera.cx + 0.5) * scale - 0.5;
  camera.cy = (camera.cy + 0.5) * scale - 0.5 + 0.5 * (height - 960 * scale);
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace

const std::vector<std::string>& corpus_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Corpus& corpus : kCorpora) result.emplace_back(corpus.name);
    return result;
  }();
  return names;
}

Scene corpus_scene(const std::string& name, int index, int width, int height) {
  if (index < 0) throw Error("simulator: corpus index " + std::to_string(index) + " is below 0");
  if (width < 240 || height < 180 || width > 16384 || height > 16384) {
    throw Error("simulator: corpora need an image of 240x180 to 16384x16384, not " + std::to_string(width) + "x" +
                std::to_string(height));
  }
  u64 salt = 0;
  for (const Corpus& corpus : kCorpora) {
    ++salt;
    if (name != corpus.name) continue;
    Frame frame(scatter(salt * 1000003 + static_cast<u64>(index)), corpus_camera(width, height));
    corpus.build(frame, index);
    return std::move(frame.scene);
  }
  std::string known;
  for (const Corpus& corpus : kCorpora) known += std::string(known.empty() ? "" : ", ") + corpus.name;
  throw Error("simulator: no corpus \"" + name + "\": use one of " + known);
}

}  // namespace berth::sim
