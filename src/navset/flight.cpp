#include "navset/flight.hpp"

#include <algorithm>

#include "navset/lighting.hpp"
#include "navset/parts.hpp"
#include "navset/sample.hpp"

namespace berth::navset {
namespace {

constexpr int kBackdrop_px = 800;
// Amplitudes far away; they shrink on the way.
constexpr double kSwing_x = 0.20, kSwing_y = 0.12;  // of the marker's direction, as slopes
constexpr double kTilt_rad = 0.35;

}  // namespace

double Flight::Swing::at(double u) const { return sim::exact_sin(2 * sim::kPi * (turns * u + phase)); }

Flight::Flight(u64 seed, int frames, bool with_target)
    : seed_(sim::scatter(seed)), frames_(frames), with_target_(with_target) {
  sim::Random random(seed_);
  livery_ = &pick(random, liveries());
  model_ = target_model(*livery_, random.bits());
  static const std::vector<BackdropKind> kKinds = {BackdropKind::lab, BackdropKind::station, BackdropKind::earth,
                                                   BackdropKind::stars};
  kind_ = pick(random, kKinds);
  backdrop_ = render_backdrop(kind_, random.bits(), kBackdrop_px);
  light_ = random_light(kind_ == BackdropKind::earth || kind_ == BackdropKind::stars, random, mood_);
  // A docking is planned for light on the face that is docked to: within 30 degrees of the camera's axis, or the ring's
  // shadow lies on the marker.
  light_.key = sim::normalized({0.4 * light_.key[0], 0.4 * light_.key[1], -1});
  light_.ambient = std::max(0.05, light_.ambient);
  mirror_gain_ = random.uniform(0.4, 1.2);
  brightness_ = log_uniform(random, 0.45, 1.0);
  if (random.chance(0.5)) exposure_.gamma = random.uniform(0.7, 1.25);
  exposure_.black_level = random.uniform(0, 10);
  exposure_.blur_sigma_px = log_uniform(random, 0.3, 0.8);
  exposure_.full_well_e = log_uniform(random, 4000, 20000);
  exposure_.read_noise = log_uniform(random, 0.5, 2.5);
  for (Swing* swing : {&swing_x_, &swing_y_, &tilt_x_, &tilt_y_, &pan_}) {
    swing->turns = random.uniform(0.5, 2);
    swing->phase = random.uniform(0, 1);
  }
  roll_from_ = random.uniform(-sim::kPi, sim::kPi);
  roll_by_ = random.uniform(-0.8, 0.8);
}

CameraModel Flight::camera() {
  CameraModel model;
  model.width = kFrameWidth_px;
  model.height = kFrameHeight_px;
  model.fx = model.fy = kFrameFocal_px;
  model.cx = (kFrameWidth_px - 1) / 2.0;
  model.cy = (kFrameHeight_px - 1) / 2.0;
  return model;
}

std::string Flight::title() const { return livery_->name + ", " + name_of(kind_) + ", " + mood_; }

void Flight::place(double u, FlightFrame& frame) const {
  frame.marker_range_m = kFrom_m * exact_pow(kTo_m / kFrom_m, u);
  const double far = std::min(1.0, (frame.marker_range_m - kTo_m) / 2);
  const Vec3 direction = sim::normalized({kSwing_x * far * swing_x_.at(u), kSwing_y * far * swing_y_.at(u), 1});
  const double tilt = kTilt_rad * (0.2 + 0.8 * far);
  frame.marker.R =
      sim::product(sim::rotation_z(roll_from_ + roll_by_ * u),
                   sim::product(sim::rotation_y(tilt * tilt_y_.at(u)), sim::rotation_x(tilt * tilt_x_.at(u))));
  frame.marker.t = sim::scaled(direction, frame.marker_range_m);
  frame.target = sim::compose(frame.marker, sim::inverse(dock_marker_pose()));
  const Vec3& t = frame.target.t;
  const CameraModel lens = camera();
  frame.x = lens.cx + lens.fx * t[0] / t[2];
  frame.y = lens.cy + lens.fy * t[1] / t[2];
  frame.d_px = lens.fx * kTargetDiameter_m / t[2];
}

std::vector<double> Flight::background(double u) const {
  const int slack_x = kBackdrop_px - kFrameWidth_px, slack_y = kBackdrop_px - kFrameHeight_px;
  const int x0 = static_cast<int>(slack_x * (0.5 + 0.5 * pan_.at(u))), y0 = static_cast<int>(slack_y * u);
  std::vector<double> radiance;
  radiance.reserve(static_cast<std::size_t>(kFrameWidth_px) * kFrameHeight_px);
  for (int y = 0; y < kFrameHeight_px; ++y) {
    for (int x = 0; x < kFrameWidth_px; ++x) radiance.push_back(backdrop_.view().at(x0 + x, y0 + y) * (0.8 / 255));
  }
  return radiance;
}

FlightFrame Flight::frame(int index) const {
  const double u = frames_ > 1 ? static_cast<double>(index) / (frames_ - 1) : 0;
  FlightFrame frame;
  place(u, frame);
  Scene scene;
  if (with_target_) scene.place(model_, frame.target, 1, Owner::target);
  Camera pinhole;
  pinhole.width = kFrameWidth_px;
  pinhole.height = kFrameHeight_px;
  pinhole.focal_px = kFrameFocal_px;
  pinhole.cx = camera().cx;
  pinhole.cy = camera().cy;
  std::vector<double> radiance = background(u);
  const Surroundings mirror{backdrop_.view().data, kBackdrop_px, mirror_gain_};
  draw(scene, pinhole, light_, mirror, 2, radiance);
  Exposure exposure = exposure_;
  exposure.gain = std::min(4.0, std::max(0.3, brightness_ / std::max(0.02, metered(radiance))));
  frame.image = GrayImage(kFrameWidth_px, kFrameHeight_px);
  develop(radiance, exposure, sensor_, sim::scatter(seed_ + static_cast<u64>(index) + 1), frame.image.view());
  return frame;
}

}  // namespace berth::navset
