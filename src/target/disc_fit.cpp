#include "target/disc_fit.hpp"

#include <algorithm>
#include <cmath>

#include "exact_math.hpp"
#include "pose_algebra.hpp"
#include "target/sample.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

// The pixels that are looked at lie so far off the edge, px, or so many deviations of its blur, and no further than
// these shares of the shorter half axis: inside of that a ring's hole begins (at 0.4), outside of it a neighbour may.
constexpr double kReach = 3, kReachBlur = 2.5, kInsideRing = 0.3, kInsideDisc = 0.85, kOutside = 0.4, kLeastReach = 1.2;
// Of those pixels so many are used, evenly: enough for any disc, and a bound of the time. At first fewer.
constexpr double kEnough = 1200, kEnoughAtFirst = 200;
constexpr std::size_t kMostPixels = 2048, kFewestPixels = 40;
constexpr int kMostSteps = 10;
// A step of the centre this small, px, and of the blur, as a share, is the last; and the blur's greatest.
constexpr double kStill = 5e-4, kStillBlur = 0.02, kMostBlurStep = 0.4;
// No lens and pixel make an edge as sharp as the least, under which steps would end nowhere.
constexpr double kFirstBlur = 0.8, kLeastBlur = 0.35, kDamping = 1e-3;
// Squared distance from the middle, by the ellipse's, within which the distance from the edge means nothing.
constexpr double kNearMiddle = 1e-3;
// Of the shorter half axis: under more blur than this a ring's hole is no longer told from a disc's dark.
constexpr double kMostBlur = 0.27;
// How light the middle is, from dark to light, of a disc at most and of a ring at least: what lies between is blurred
// beyond telling.
constexpr double kMostOfDisc = 0.3, kLeastOfRing = 0.55;
// Grey levels between dark and light; and how much of them what the model leaves may be, besides noise.
constexpr double kLeastContrast = 12, kLeft = 0.12, kNoise = 3;
// The same before the first step, when the edge is a third of a pixel off and its blur a guess: most of what is round
// but no disc ends here.
constexpr double kLeftAtFirst = 0.25, kNoiseAtFirst = 5;

// The unknowns.
enum : std::size_t { kX, kY, kXX, kXY, kYY, kDark, kLight, kLightX, kLightY, kBlur, kUnknowns };
using Normal = SquareMatrix<kUnknowns>;
using Unknowns = std::array<double, kUnknowns>;

/// From pixels about a place in the image to the undistorted plane, scaled so that both agree there: the second order
/// of the lens. What the lens does beyond that is odd about the place, and moves no centre.
struct LocalMap {
  Vec2 origin_px{}, origin{};
  std::array<double, 4> lens{};
  std::array<double, 3> hx{}, hy{};  // of x and of y by xx, xy, yy, halved

  bool set(const CameraModel& camera, const Vec2& at, double step) {
    origin_px = at;
    origin = camera.undistort(at[0], at[1]);
    camera.project(origin[0], origin[1], lens);
    const Vec2 right = local(camera, step, 0), left = local(camera, -step, 0);
    const Vec2 down = local(camera, 0, step), up = local(camera, 0, -step);
    const Vec2 both = local(camera, step, step), neither = local(camera, -step, -step);
    const double by = 1 / (2 * step * step);
    for (std::size_t k = 0; k < 2; ++k) {
      std::array<double, 3>& h = k == 0 ? hx : hy;
      h[0] = (right[k] + left[k]) * by;
      h[2] = (down[k] + up[k]) * by;
      h[1] = (both[k] + neither[k]) * by - h[0] - h[2];
      if (!finite(h[0] + h[1] + h[2])) return false;
    }
    return lens[0] * lens[3] - lens[1] * lens[2] > 0;
  }

  Vec2 local(const CameraModel& camera, double x, double y) const {
    const Vec2 plane = camera.undistort(origin_px[0] + x, origin_px[1] + y);
    const double px = plane[0] - origin[0], py = plane[1] - origin[1];
    return {lens[0] * px + lens[1] * py, lens[2] * px + lens[3] * py};
  }

  Vec2 at(double x, double y) const {
    return {x + hx[0] * x * x + hx[1] * x * y + hx[2] * y * y, y + hy[0] * x * x + hy[1] * x * y + hy[2] * y * y};
  }
  /// The gradient by pixels, of one by the local plane.
  Vec2 gradient(double x, double y, const Vec2& g) const {
    const double xx = 1 + 2 * hx[0] * x + hx[1] * y, xy = hx[1] * x + 2 * hx[2] * y;
    const double yx = 2 * hy[0] * x + hy[1] * y, yy = 1 + hy[1] * x + 2 * hy[2] * y;
    return {xx * g[0] + yx * g[1], xy * g[0] + yy * g[1]};
  }
  /// Back into the camera's plane: a vector of the local one.
  Vec2 back(const Vec2& v) const {
    const double det = lens[0] * lens[3] - lens[1] * lens[2];
    return {(lens[3] * v[0] - lens[1] * v[1]) / det, (lens[0] * v[1] - lens[2] * v[0]) / det};
  }
};

/// Mean grey level of five points about the ellipse's centre; false where they are not all in the image.
bool middle_level(View2D<const u8> image, const Ellipse& ellipse, double& level) {
  constexpr double kAside = 0.15;
  const double x = kAside * std::sqrt(ellipse.matrix[0]), y = kAside * std::sqrt(ellipse.matrix[2]);
  double sum = 0;
  for (const Vec2& off : {Vec2{0, 0}, Vec2{x, 0}, Vec2{-x, 0}, Vec2{0, y}, Vec2{0, -y}}) {
    double one = 0;
    if (!sample(image, ellipse.center[0] + off[0], ellipse.center[1] + off[1], one)) return false;
    sum += one;
  }
  level = sum / 5;
  return true;
}

/// The model, its unknowns as they are, and the pixels that they are fitted to.
class EdgeModel {
 public:
  EdgeModel(View2D<const u8> image, const EdgeProfile& profile, const LocalMap& map, const Ellipse& start,
            std::vector<EdgePixel>& pixels)
      : image_(image), profile_(profile), map_(map), pixels_(pixels) {
    const double det = start.determinant();
    state_ = {0, 0, start.matrix[2] / det, -start.matrix[1] / det, start.matrix[0] / det, 0, 0, 0, 0, kFirstBlur};
    radius_ = std::sqrt(start.axes_squared()[1]);
  }

  /// Takes the pixels near the edge as it is now. False where they are not all in the image, or too few.
  bool take_pixels(double reach_px, bool ring, double enough) {
    const Ellipse now{{}, matrix()};
    const std::array<double, 2> axes = now.axes_squared();
    const double shorter = std::sqrt(axes[0]), longer = std::sqrt(axes[1]);
    const double inside = std::max(kLeastReach, std::min(reach_px, (ring ? kInsideRing : kInsideDisc) * shorter));
    const double outside = std::max(kLeastReach, std::min(reach_px, kOutside * shorter));
    const int every = 1 + static_cast<int>(kPi * (shorter + longer) * (inside + outside) / enough);
    const double x = map_.origin_px[0] + state_[kX], y = map_.origin_px[1] + state_[kY];
    const double across = std::sqrt(now.matrix[0]) + outside + 1, down = std::sqrt(now.matrix[2]) + outside + 1;
    if (!(x - across >= 0 && y - down >= 0 && x + across < image_.width && y + down < image_.height)) return false;
    // Of q, bounds that leave out most of the box before the distance itself is had, which no stretch of the lens over
    // the disc makes wrong.
    const double least = std::max(0.0, 1 - 1.2 * inside / shorter), most = 1 + 1.2 * outside / shorter;
    pixels_.clear();
    int number = 0;
    double dark = 0, light = 0;
    int darks = 0, lights = 0;
    for (int v = static_cast<int>(y - down); v <= static_cast<int>(y + down); ++v) {
      const u8* const row = image_.row(v);
      for (int u = static_cast<int>(x - across); u <= static_cast<int>(x + across); ++u) {
        EdgePixel pixel{u - map_.origin_px[0], v - map_.origin_px[1], {}, static_cast<double>(row[u])};
        pixel.local = map_.at(pixel.x, pixel.y);
        const double q = q_of(pixel);
        if (q < least * least || q > most * most) continue;
        const Place place = place_of(pixel);
        if (!(place.distance > -inside && place.distance < outside) || number++ % every != 0) continue;
        if (pixels_.size() == kMostPixels) return false;
        pixels_.push_back(pixel);
        if (place.distance < -0.6 * inside) dark += pixel.level, ++darks;
        if (place.distance > 0.6 * outside) light += pixel.level, ++lights;
      }
    }
    if (darks < 4 || lights < 4) return false;
    first_dark_ = dark / darks;
    first_light_ = light / lights;
    return pixels_.size() >= kFewestPixels;
  }

  /// Mean levels of the pixels well inside and well outside of the edge.
  double first_dark() const { return first_dark_; }
  double first_light() const { return first_light_; }
  void start_levels() {
    state_[kDark] = first_dark_;
    state_[kLight] = first_light_;
  }

  /// Whether what the model leaves is no more than so many grey levels and so much of the contrast.
  bool leaves_at_most(double levels, double share) const {
    Normal normal{};
    Unknowns gradient{};
    const double most = levels + share * (state_[kLight] - state_[kDark]);
    return add_up(normal, gradient) <= most * most * static_cast<double>(pixels_.size());
  }

  /// Gauss-Newton until the centre rests (`rests`), or as long as it may; false where it goes astray.
  bool settle() {
    rests_ = false;
    for (int i = 0; i < kMostSteps && !rests_; ++i) {
      if (!step(rests_)) return false;
    }
    return true;
  }
  bool rests() const { return rests_; }

  /// What is left, and the centre's covariance.
  bool finish(FittedDisc& disc) const {
    Normal normal{};
    Unknowns gradient{};
    const double squares = add_up(normal, gradient);
    for (std::size_t i = 0; i < kUnknowns; ++i) {
      for (std::size_t j = 0; j < i; ++j) normal[j * kUnknowns + i] = normal[i * kUnknowns + j];
    }
    Normal inverse{};
    if (!invert<kUnknowns>(normal, inverse)) return false;
    const double variance = squares / static_cast<double>(pixels_.size() - kUnknowns);
    disc.dark = state_[kDark];
    disc.light = state_[kLight];
    disc.blur_px = state_[kBlur];
    disc.noise = std::sqrt(variance);
    disc.covariance_px2 = {variance * inverse[0], variance * inverse[1], variance * inverse[kUnknowns + 1]};
    const double contrast = disc.light - disc.dark;
    return contrast >= kLeastContrast && disc.noise <= kNoise + kLeft * contrast;
  }

  Vec2 center() const { return {state_[kX], state_[kY]}; }
  double blur_px() const { return state_[kBlur]; }
  std::array<double, 3> matrix() const {
    const double det = state_[kXX] * state_[kYY] - state_[kXY] * state_[kXY];
    return {state_[kYY] / det, -state_[kXY] / det, state_[kXX] / det};
  }

 private:
  /// Where a pixel lies by the ellipse.
  struct Place {
    double x, y;      // from its centre, in the local plane
    double gx, gy;    // half the gradient of q, which is 1 on it
    double root;      // of q
    double steep;     // of the root by pixels
    double distance;  // from the edge, px, negative inside
  };

  double q_of(const EdgePixel& pixel) const {
    const double x = pixel.local[0] - state_[kX], y = pixel.local[1] - state_[kY];
    return state_[kXX] * x * x + 2 * state_[kXY] * x * y + state_[kYY] * y * y;
  }

  Place place_of(const EdgePixel& pixel) const {
    Place p{};
    p.x = pixel.local[0] - state_[kX];
    p.y = pixel.local[1] - state_[kY];
    p.gx = state_[kXX] * p.x + state_[kXY] * p.y;
    p.gy = state_[kXY] * p.x + state_[kYY] * p.y;
    p.root = std::sqrt(std::max(kNearMiddle, p.x * p.gx + p.y * p.gy));
    const Vec2 by = map_.gradient(pixel.x, pixel.y, {p.gx / p.root, p.gy / p.root});
    p.steep = std::sqrt(std::max(1e-12, by[0] * by[0] + by[1] * by[1]));
    p.distance = (p.root - 1) / p.steep;
    return p;
  }

  bool step(bool& still) {
    Normal normal{};
    Unknowns gradient{};
    add_up(normal, gradient);
    // Barely damped: where an edge is a few pixels in all, blur and levels are hard to tell apart at first.
    for (std::size_t i = 0; i < kUnknowns; ++i) normal[i * kUnknowns + i] *= 1 + kDamping;
    if (!factorise<kUnknowns>(normal)) return false;
    Unknowns by = solve<kUnknowns>(normal, gradient);
    by[kBlur] = std::max(-kMostBlurStep * state_[kBlur], std::min(kMostBlurStep * state_[kBlur], by[kBlur]));
    by[kBlur] = std::max(by[kBlur], kLeastBlur - state_[kBlur]);
    for (std::size_t i = 0; i < kUnknowns; ++i) state_[i] += by[i];
    still = by[kX] * by[kX] + by[kY] * by[kY] < kStill * kStill && std::fabs(by[kBlur]) < kStillBlur * state_[kBlur];
    const double det = state_[kXX] * state_[kYY] - state_[kXY] * state_[kXY];
    const double off = state_[kX] * state_[kX] + state_[kY] * state_[kY];
    return finite(off + det) && state_[kXX] > 0 && det > 0 && off < 4 + 0.04 * radius_ * radius_ &&
           state_[kBlur] < 1 + 0.5 * radius_;
  }

  /// Adds to the lower triangle; returns the sum of squares.
  double add_up(Normal& normal, Unknowns& gradient) const {
    double squares = 0;
    const double contrast = state_[kLight] - state_[kDark];
    for (const EdgePixel& pixel : pixels_) {
      const Place p = place_of(pixel);
      double level = 0, slope = 0;
      edge(p.distance / state_[kBlur], level, slope);
      const double u = p.x / radius_, v = p.y / radius_;
      const double light = contrast + state_[kLightX] * u + state_[kLightY] * v;
      const double off = pixel.level - state_[kDark] - light * level;
      // The level by the distance, and the distance by the unknowns: of the root over its steepness, which is held.
      const double by_distance = light * slope / state_[kBlur];
      const double f = by_distance / (p.steep * p.root);
      const Unknowns row = {
          -f * p.gx, -f * p.gy, f * p.x * p.x / 2, f * p.x * p.y, f * p.y * p.y / 2,
          1 - level, level,     level * u,         level * v,     -by_distance * p.distance / state_[kBlur]};
      for (std::size_t i = 0; i < kUnknowns; ++i) {
        gradient[i] += row[i] * off;
        for (std::size_t j = 0; j <= i; ++j) normal[i * kUnknowns + j] += row[i] * row[j];
      }
      squares += off * off;
    }
    return squares;
  }

  /// A blurred step and its derivative, t deviations past it.
  void edge(double t, double& level, double& slope) const {
    constexpr double kOne = 16384, kEnd = EdgeProfile::kReach - 1.0 / 64;
    if (!(t > -kEnd && t < kEnd)) {
      level = t > 0 ? 1 : 0;
      slope = 0;
      return;
    }
    constexpr int kMiddle = EdgeProfile::kReach << EdgeProfile::kPerDeviation_bits;
    const double place = (t + EdgeProfile::kReach) * (1 << EdgeProfile::kPerDeviation_bits);
    const int index = static_cast<int>(place);
    const double part = place - index;
    const EdgePoint &below = profile_.at(index - kMiddle), &above = profile_.at(index + 1 - kMiddle);
    level = (below.level + part * (above.level - below.level)) / kOne;
    slope = (below.slope + part * (above.slope - below.slope)) / kOne;
  }

  const View2D<const u8> image_;
  const EdgeProfile& profile_;
  const LocalMap& map_;
  std::vector<EdgePixel>& pixels_;
  Unknowns state_{};
  double radius_ = 0, first_dark_ = 0, first_light_ = 0;
  bool rests_ = false;
};

}  // namespace

DiscFit::DiscFit(const CameraModel& camera) : camera_(camera) { pixels_.reserve(kMostPixels); }

bool DiscFit::fit(View2D<const u8> image, const Ellipse& start, FittedDisc& disc) {
  LocalMap map;
  if (!map.set(camera_, start.center, std::max(2.0, std::sqrt(start.axes_squared()[1])))) return false;
  EdgeModel model(image, profile_, map, start, pixels_);
  double middle = 0;
  if (!model.take_pixels(kReach, true, kEnoughAtFirst) || !middle_level(image, start, middle)) return false;
  const double first_dark = model.first_dark(), first_light = model.first_light();
  if (first_light - first_dark < kLeastContrast) return false;
  const double share = (middle - first_dark) / (first_light - first_dark);
  if (share > kMostOfDisc && share < kLeastOfRing) return false;
  disc.is_ring = share > kMostOfDisc;
  // Then again, about the edge as it has been found, as far off as its blur asks for.
  if (!disc.is_ring && !model.take_pixels(kReach, false, kEnoughAtFirst)) return false;
  model.start_levels();
  if (!model.leaves_at_most(kNoiseAtFirst, kLeftAtFirst) || !model.settle()) return false;
  if (!model.take_pixels(std::max(kReach, kReachBlur * model.blur_px()), disc.is_ring, kEnough)) return false;
  if (!model.settle() || !model.rests() || !model.finish(disc)) return false;
  disc.lens = map.lens;
  const Vec2 center = map.back(model.center());
  disc.in_plane.center = {map.origin[0] + center[0], map.origin[1] + center[1]};
  disc.center_px = camera_.project(disc.in_plane.center[0], disc.in_plane.center[1]);
  const std::array<double, 3> m = model.matrix();
  disc.axes_px2 = Ellipse{{}, m}.axes_squared();
  if (disc.blur_px > kMostBlur * std::sqrt(disc.axes_px2[0])) return false;
  // M in the plane: its columns taken back, then what has become of its rows.
  const Vec2 first = map.back({m[0], m[1]}), second = map.back({m[1], m[2]});
  const Vec2 left = map.back({first[0], second[0]}), right = map.back({first[1], second[1]});
  disc.in_plane.matrix = {left[0], left[1], right[1]};
  return true;
}

}  // namespace berth
