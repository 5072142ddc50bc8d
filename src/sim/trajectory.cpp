#include "sim/trajectory.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "sim/random.hpp"
#include "sim/toml_reader.hpp"

namespace berth::sim {
namespace {

Mat3 rotation_deg(const Vec3& angles) { return rotation(radians(angles[0]), radians(angles[1]), radians(angles[2])); }

template <class T>
T between(const T& from, const T& to, double s) {
  T result = from;
  for (std::size_t i = 0; i < from.size(); ++i) result[i] = from[i] + s * (to[i] - from[i]);
  return result;
}

constexpr double kMostRange_m = 50;
constexpr double kLeastRange_m = 0.05;

// Closing in along a line, with an offset and a rotation that shrink on the way and the sway of a free-floating robot.
class Approach final : public Trajectory {
 public:
  explicit Approach(TomlReader& reader) {
    from_range_ = reader.number("from_range_m", 1.6, kLeastRange_m, kMostRange_m);
    to_range_ = reader.number("to_range_m", 0.18, kLeastRange_m, kMostRange_m);
    slowing_ = reader.choice("profile", "even", {"even", "slowing"}) == "slowing";
    from_offset_ = reader.pair("from_offset_m", {0, 0}, -10, 10);
    to_offset_ = reader.pair("to_offset_m", {0, 0}, -10, 10);
    from_rotation_ = reader.triple("from_rotation_deg", {0, 0, 0}, -180, 180);
    to_rotation_ = reader.triple("to_rotation_deg", {0, 0, 0}, -180, 180);
    sway_m_ = reader.triple("sway_m", {0, 0, 0}, -1, 1);
    sway_deg_ = reader.triple("sway_deg", {0, 0, 0}, -60, 60);
    sway_period_s_ = reader.number("sway_period_s", 4, 0.05, 1000);
  }

  Pose body(double s, double time_s) const override {
    // Slowing: the same share of the remaining range in each second.
    const double range = slowing_ ? from_range_ * exact_exp(s * exact_log(to_range_ / from_range_))
                                  : from_range_ + s * (to_range_ - from_range_);
    const Vec2 offset = between(from_offset_, to_offset_, s);
    Vec3 angles = between(from_rotation_, to_rotation_, s);
    Pose pose = translation(offset[0], offset[1], range);
    for (std::size_t i = 0; i < 3; ++i) {
      // Different periods, so that the axes do not sway in step.
      constexpr std::array<double, 3> kPeriods = {1, 1.31, 1.73};
      const double phase = 2 * kPi * time_s / (sway_period_s_ * kPeriods[i]);
      pose.t[i] += sway_m_[i] * exact_sin(phase);
      angles[i] += sway_deg_[i] * exact_sin(0.83 * phase + 1);
    }
    pose.R = rotation_deg(angles);
    return pose;
  }

 private:
  double from_range_, to_range_;
  bool slowing_;
  Vec2 from_offset_, to_offset_;
  Vec3 from_rotation_, to_rotation_, sway_m_, sway_deg_;
  double sway_period_s_;
};

// Once around an upright rectangle at one range: upper left, upper right, lower right, lower left, back.
class Rectangle final : public Trajectory {
 public:
  explicit Rectangle(TomlReader& reader) {
    width_ = reader.number("width_m", 0.6, 0.001, 20);
    height_ = reader.number("height_m", 0.4, 0.001, 20);
    range_ = reader.number("range_m", 1.0, kLeastRange_m, kMostRange_m);
    center_ = reader.pair("center_m", {0, 0}, -10, 10);
    rotation_ = reader.triple("rotation_deg", {0, 0, 0}, -180, 180);
  }

  Pose body(double s, double /*time_s*/) const override {
    const double around = 2 * (width_ + height_);
    double way = (s - static_cast<double>(floor_int(s))) * around;
    if (s == 1) way = around;
    Vec2 at = {-width_ / 2, -height_ / 2};
    const double across = std::min(way, width_), down = std::min(std::max(0.0, way - width_), height_);
    const double back = std::min(std::max(0.0, way - width_ - height_), width_);
    const double up = std::max(0.0, way - 2 * width_ - height_);
    at = {at[0] + across - back, at[1] + down - up};
    Pose pose = translation(center_[0] + at[0], center_[1] + at[1], range_);
    pose.R = rotation_deg(rotation_);
    return pose;
  }

 private:
  double width_, height_, range_;
  Vec2 center_;
  Vec3 rotation_;
};

// One axis of a six-axis table; the others stay at their nominal place.
class Axis final : public Trajectory {
 public:
  explicit Axis(TomlReader& reader) {
    const std::vector<std::string> names = {"x", "y", "z", "rx", "ry", "rz"};
    if (!reader.has("axis")) reader.fail("axis", "say which axis moves: \"x\", \"y\", \"z\", \"rx\", \"ry\" or \"rz\"");
    const std::string name = reader.choice("axis", "x", names);
    axis_ = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    const double most = axis_ < 3 ? 10 : 85;
    from_ = reader.number("from", axis_ < 3 ? -0.2 : -30, -most, most);
    to_ = reader.number("to", axis_ < 3 ? 0.2 : 30, -most, most);
    position_ = reader.triple("position_m", {0, 0, 0.8}, -20, kMostRange_m);
    rotation_ = reader.triple("rotation_deg", {0, 0, 0}, -180, 180);
    if (position_[2] < kLeastRange_m) reader.fail("position_m", "keep the range, the third number, above 0.05 m");
    if (axis_ == 2 && position_[2] + std::min(from_, to_) < kLeastRange_m) {
      reader.fail("from", "keep the range position_m[2] + from … to above 0.05 m");
    }
  }

  Pose body(double s, double /*time_s*/) const override {
    Vec3 at = position_, angles = rotation_;
    const double value = from_ + s * (to_ - from_);
    if (axis_ < 3) {
      at[axis_] += value;
    } else {
      angles[axis_ - 3] += value;
    }
    Pose pose = translation(at[0], at[1], at[2]);
    pose.R = rotation_deg(angles);
    return pose;
  }

 private:
  std::size_t axis_;
  double from_, to_;
  Vec3 position_, rotation_;
};

// A board held still before the camera, another way in each frame: as one calibrates a camera.
class Views final : public Trajectory {
 public:
  Views(TomlReader& reader, int frames) : frames_(frames) {
    range_ = reader.pair("range_m", {0.4, 0.6}, kLeastRange_m, kMostRange_m);
    view_ = reader.pair("view", {0.25, 0.18}, 0, 5);
    tilt_ = reader.pair("tilt_deg", {10, 40}, 0, 80);
    roll_deg_ = reader.number("roll_deg", 15, 0, 180);
    seed_ = static_cast<u64>(reader.integer("views_seed", 1, 0, 2147483647));
  }

  Pose body(double s, double /*time_s*/) const override {
    const long long frame = floor_int(s * std::max(1, frames_ - 1) + 0.5);
    Random random(seed_ + static_cast<u64>(frame));
    const double across = random.uniform(-view_[0], view_[0]);
    const double down = random.uniform(-view_[1], view_[1]);
    const double range = random.uniform(range_[0], range_[1]);
    const double tilt = random.uniform(tilt_[0], tilt_[1]);
    // About axes all around the board, in turn: no two neighbours lean the same way.
    const double axis = kGoldenTurn_deg * static_cast<double>(frame);
    const double roll = random.uniform(-roll_deg_, roll_deg_);
    Pose pose = translation(across * range, down * range, range);
    const Mat3 lean =
        product(rotation_deg({0, 0, axis}), product(rotation_deg({tilt, 0, 0}), rotation_deg({0, 0, -axis})));
    pose.R = product(lean, rotation_deg({0, 0, roll}));
    return pose;
  }

 private:
  static constexpr double kGoldenTurn_deg = 137.50776405003785;
  int frames_;
  Vec2 range_, view_, tilt_;
  double roll_deg_;
  u64 seed_;
};

}  // namespace

std::unique_ptr<Trajectory> read_trajectory(TomlReader& reader, int frames) {
  const std::string kind = reader.choice("kind", "approach", {"approach", "rectangle", "axis", "views"});
  std::unique_ptr<Trajectory> trajectory;
  if (kind == "approach") trajectory = std::make_unique<Approach>(reader);
  if (kind == "rectangle") trajectory = std::make_unique<Rectangle>(reader);
  if (kind == "views") trajectory = std::make_unique<Views>(reader, frames);
  if (kind == "axis") trajectory = std::make_unique<Axis>(reader);
  return trajectory;
}

Motion motion_between(const Pose& before, const Pose& after) {
  const Pose step = compose(after, inverse(before));
  const Mat3& R = step.R;
  // The rotation vector that small_rotation turns back into R.
  const double scale = 2 / (1 + R[0] + R[4] + R[8]);
  Motion motion;
  motion.turn = {scale * (R[7] - R[5]), scale * (R[2] - R[6]), scale * (R[3] - R[1])};
  motion.shift = step.t;
  return motion;
}

}  // namespace berth::sim
