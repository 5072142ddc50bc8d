#include "navset/sample.hpp"

#include <algorithm>
#include <cmath>

#include "navset/develop.hpp"
#include "navset/lighting.hpp"
#include "navset/things.hpp"

namespace berth::navset {
namespace {

using sim::Random;

// Where the search hands a window over, the target is this near its middle, px; now and then it is anywhere.
constexpr double kCentring_px = 32, kAnywhere = 0.05;
constexpr double kFarthest_px = 8, kMost_px = 230;

}  // namespace

// One attempt at one image.
class Studio::Shot {
 public:
  Shot(const Studio& studio, const Pool& pool, Subject subject, u64 key) : studio_(studio), pool_(pool), random_(key) {
    label_.subject = subject;
  }

  bool take(View2D<u8> image) {
    choose_backdrop();
    choose_size();
    choose_light();
    place_subject();
    surround();
    std::vector<double> radiance = cut_backdrop(backdrop_, space_, random_);
    const Surroundings mirror{backdrop_.data, backdrop_.width, random_.uniform(0.4, 1.2)};
    const Sighting seen = draw(scene_, camera_, light_, mirror, 2, radiance);
    const Exposure exposure = random_exposure(radiance, pool_.conditions.dimmest, random_);
    if (label_.subject == Subject::target && !judge(seen, exposure.gain)) return false;
    develop(radiance, exposure, studio_.sensor_, random_.bits(), image);
    return !black(image);
  }

  const Label& label() const { return label_; }

 private:
  void choose_backdrop() {
    const bool photo = !pool_.backdrops[1].empty() && random_.chance(0.5);
    label_.backdrop = pick(random_, pool_.backdrops[photo ? 1 : 0]);
    backdrop_ = studio_.gallery_.pixels(label_.backdrop);
    const BackdropKind kind = studio_.gallery_.kind(label_.backdrop);
    space_ = kind == BackdropKind::earth || kind == BackdropKind::stars || kind == BackdropKind::abstract;
  }

  // Size and place of the subject in the window, and the window's place in the camera's frame.
  void choose_size() {
    const double least = pool_.conditions.least_px;
    far_ = random_.chance(pool_.conditions.far_share);
    d_px_ = far_ ? log_uniform(random_, kFarthest_px, least) : log_uniform(random_, least, kMost_px);
    // A window is never cut from nearer than a metre: there the marker has long taken over.
    const double least_focal = std::max(kFrameFocal_px * kSide_px / kFrameWidth_px, d_px_ / kTargetDiameter_m);
    camera_.focal_px = log_uniform(random_, least_focal, kFrameFocal_px);
    const double shrink = camera_.focal_px / kFrameFocal_px;
    const double slack_x = std::max(0.0, kFrameWidth_px * shrink - kSide_px) / 2;
    const double slack_y = std::max(0.0, kFrameHeight_px * shrink - kSide_px) / 2;
    const double middle = (kSide_px - 1) / 2.0;
    camera_.cx = middle + random_.uniform(-slack_x, slack_x);
    camera_.cy = middle + random_.uniform(-slack_y, slack_y);
    const double reach =
        random_.chance(kAnywhere) && !far_ ? std::max(kCentring_px, kSide_px / 2.0 - d_px_ / 3) : kCentring_px;
    label_.x = middle + random_.uniform(-reach, reach);
    label_.y = middle + random_.uniform(-reach, reach);
    label_.focal_px = camera_.focal_px;
    label_.axis_x = camera_.cx;
    label_.axis_y = camera_.cy;
    depth_m_ = camera_.focal_px * kTargetDiameter_m / d_px_;
  }

  void choose_light() { light_ = random_light(space_, random_, label_.light); }

  Vec3 at(double x, double y, double depth) const {
    return {(x - camera_.cx) / camera_.focal_px * depth, (y - camera_.cy) / camera_.focal_px * depth, depth};
  }

  // A rotation by up to so much about x, then y, then z.
  Mat3 turned(double x, double y, double z) {
    const double rx = random_.uniform(-x, x), ry = random_.uniform(-y, y), rz = random_.uniform(-z, z);
    return sim::rotation(rx, ry, rz);
  }

  const Livery& choose_livery() {
    label_.livery = pick(random_, pool_.liveries);
    return liveries()[static_cast<std::size_t>(label_.livery)];
  }

  Model satellite() {
    if (pool_.meshes.empty() || !random_.chance(0.35)) return other_satellite(random_);
    const double tone = random_.uniform(0.3, 0.85);
    const u64 seed = random_.bits();
    Part hull = part(ShapeKind::mesh, {0.2, 0, 0}, {0, 0, 0},
                     random_.chance(0.3) ? foil(tone, 0.02, seed) : textured(Texture::panels, tone, 0.2, 0.06, seed));
    hull.shape.mesh = &studio_.meshes_[static_cast<std::size_t>(pick(random_, pool_.meshes))];
    return {hull};
  }

  Model subject() {
    switch (label_.subject) {
      case Subject::target:
      case Subject::background:
        break;
      case Subject::clutter:
        return clutter(random_);
      case Subject::robot:
        return robot(random_);
      case Subject::satellite:
        return satellite();
      case Subject::piece: {
        const Livery& livery = choose_livery();
        const auto piece = static_cast<Piece>(random_.integer(0, static_cast<int>(Piece::count) - 1));
        return target_piece(livery, piece, random_.bits());
      }
      case Subject::decoy: {
        const Livery& livery = choose_livery();
        return decoy(livery, random_);
      }
    }
    const Livery& livery = choose_livery();
    return target_model(livery, random_.bits());
  }

  void place_subject() {
    if (label_.subject == Subject::background) return;
    const Model model = subject();
    Pose pose;
    pose.R = random_attitude(random_);
    pose.t = at(label_.x, label_.y, depth_m_);
    double scale = 1;
    if (label_.subject != Subject::target) {
      // Things that stand mostly stand upright. All come in the target's sizes.
      const bool stands = label_.subject == Subject::clutter || label_.subject == Subject::robot;
      if (stands && random_.chance(0.6)) {
        pose.R = turned(0.4, sim::kPi, 0.15);
      }
      scale = 0.5 * kTargetDiameter_m / bounding_radius(model);
    }
    scene_.place(model, pose, scale, label_.subject == Subject::target ? Owner::target : Owner::other);
  }

  // Things behind, and things before it that may hide a part.
  void surround() {
    const int behind = random_.chance(0.5) ? random_.integer(1, 3) : 0;
    for (int i = 0; i < behind; ++i) {
      const Model thing = random_.chance(0.7) ? clutter(random_) : robot(random_);
      const double size_px = log_uniform(random_, 20, 200), radius = bounding_radius(thing);
      // Far enough for the spheres not to meet.
      const double depth = depth_m_ * random_.uniform(1.3, 3) + kTargetDiameter_m / 2;
      const double scale =
          std::min(0.5 * size_px * depth / (camera_.focal_px * radius), (depth - depth_m_ - 0.2) / radius);
      const double x = random_.uniform(-20, kSide_px + 20), y = random_.uniform(-20, kSide_px + 20);
      Pose pose;
      pose.R = random_attitude(random_);
      pose.t = at(x, y, depth);
      scene_.place(thing, pose, scale, Owner::other);
    }
    if (far_ || !random_.chance(pool_.conditions.hidden_share)) return;
    const double depth = std::max(0.3, depth_m_ * random_.uniform(0.4, 0.75));
    if (depth > depth_m_ - 0.25) return;
    const double angle = random_.uniform(0, 2 * sim::kPi), off = d_px_ * random_.uniform(0, 0.4);
    Pose pose;
    pose.R = turned(0.4, 0.4, sim::kPi);
    pose.t = at(label_.x + off * sim::exact_cos(angle), label_.y + off * sim::exact_sin(angle), depth);
    const double scale = depth / depth_m_ * random_.uniform(0.5, 1.4);
    const Model thing = obstacle(random_);
    if (bounding_radius(thing) * scale < depth_m_ - depth || thing.size() == 1)
      scene_.place(thing, pose, scale, Owner::other);
  }

  bool judge(const Sighting& seen, double gain) {
    if (seen.silhouette == 0) return false;
    label_.visible = static_cast<double>(seen.visible) / static_cast<double>(seen.silhouette);
    if (label_.visible < kLeastVisible || 255 * seen.contrast * gain < pool_.conditions.least_contrast) return false;
    label_.visible_box = seen.visible_box;
    label_.full_box = seen.full_box;
    label_.d_px = d_px_;
    label_.depth_m = depth_m_;
    label_.range_m = sim::length(at(label_.x, label_.y, depth_m_));
    return true;
  }

  const Studio& studio_;
  const Pool& pool_;
  Random random_;
  Label label_;
  View2D<const u8> backdrop_;
  bool space_ = false, far_ = false;
  double d_px_ = 0, depth_m_ = 0;
  Camera camera_;
  Light light_;
  Scene scene_;
};

const char* name_of(Subject subject) {
  static constexpr const char* kNames[] = {"target", "background", "clutter", "robot", "satellite", "piece", "decoy"};
  return kNames[static_cast<std::size_t>(subject)];
}

Label Studio::make(u64 key, Subject subject, const Pool& pool, View2D<u8> image) const {
  for (u64 attempt = 0;; ++attempt) {
    Shot shot(*this, pool, subject, sim::scatter(key + attempt * 0x9e3779b97f4a7c15u));
    if (!shot.take(image)) continue;
    Label label = shot.label();
    if (subject != Subject::target) label.x = label.y = 0;
    return label;
  }
}

}  // namespace berth::navset
