#include "target/fit_pass.hpp"

#include <algorithm>
#include <cmath>

#include "target/pattern_sums.hpp"

namespace berth {
namespace {

constexpr int kSide = LensBlocks::kSide;

// Modules outside the border where pixels still count, of the one that is light; pixels count where the pattern's end
// is this many deviations of the blur away, too.
constexpr double kOutside = 0.8;
constexpr double kFromEnd = 1.2;
// The widest blur, deviations in modules: a pixel is compared with three by three modules, no more.
constexpr double kMostBlur = 0.6;
// Marker coordinates are quadratic in a block up to here, modules a pixel².
constexpr double kMostBend = 0.25;
constexpr int kLeastPixels = 60;
constexpr int kLeastPairs = 100;
// Markers smaller than this have their blocks taken in quarters, in which the field's factors are taken as constant.
constexpr double kQuarters_px = 48;

// The cast of an integer part rounds towards zero.
int rounded(double value) { return static_cast<int>(value < 0 ? value - 0.5 : value + 0.5); }
int q18(double modules) { return rounded(modules * (1 << 18)); }

std::array<int, 6> q22(const Quadratic& q) {
  constexpr double k = 1 << 22;
  return {rounded(q.c * k),  rounded(q.x * k),  rounded(q.y * k),
          rounded(q.xx * k), rounded(q.xy * k), rounded(q.yy * k)};
}

// The blur as the marker's axes see it at one place: deviations in modules, and their correlation.
struct Blur {
  Blur(const std::array<double, 3>& s, const Quadratic& u, const Quadratic& v)
      : by_u{u.x * u.x, 2 * u.x * u.y, u.y * u.y},
        by_v{v.x * v.x, 2 * v.x * v.y, v.y * v.y},
        var_u(by_u[0] * s[0] + by_u[1] * s[1] + by_u[2] * s[2]),
        var_v(by_v[0] * s[0] + by_v[1] * s[1] + by_v[2] * s[2]),
        dev_u(std::sqrt(var_u)),
        dev_v(std::sqrt(var_v)),
        by_uv{u.x * v.x, u.x * v.y + u.y * v.x, u.y * v.y},
        correlation((by_uv[0] * s[0] + by_uv[1] * s[1] + by_uv[2] * s[2]) / (dev_u * dev_v)) {}

  // Variances' derivatives by those in the image, and the covariance's.
  std::array<double, 3> by_u, by_v;
  double var_u, var_v, dev_u, dev_v;
  std::array<double, 3> by_uv;
  double correlation;
};

class Blocks {
 public:
  Blocks(const FitScene& scene, const FitState& state, const MarkerMap& map)
      : scene_(scene), state_(state), map_(map), first_(std::max(-kOutside, 1.0 * scene.cells.first())) {}

  // Blocks that the pattern may touch: columns and rows, both ends included.
  struct Range {
    int left, right, top, bottom;
  };
  Range range() const {
    double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    const double place[3] = {first_, scene_.border / 2, last()};
    for (int k = 0; k < 9; ++k) {
      std::array<double, 4> derivative{};
      const std::array<double, 2> point = map_.at(place[k % 3], place[k / 3], derivative);
      for (std::size_t axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], point[axis]);
        high[axis] = std::max(high[axis], point[axis]);
      }
    }
    // A pixel more: sides bulge between their ends and their middle.
    const auto block = [](double px, int count) {
      return static_cast<int>(std::min(count - 1.0, std::max(0.0, px))) / kSide;
    };
    const int w = scene_.image.width, h = scene_.image.height;
    return {block(low[0] - 1, w), block(high[0] + 2, w), block(low[1] - 1, h), block(high[1] + 2, h)};
  }

  bool outside(const Quadratic& u, const Quadratic& v) const {
    const auto off = [&](const Quadratic& q) {
      const double reach = 4.5 * (std::fabs(q.x) + std::fabs(q.y));
      return q.c + reach < first_ || q.c - reach > last();
    };
    return off(u) || off(v);
  }

  double contrast(double x, double y) const {
    const auto& c = state_.contrast;
    return c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
  }
  double x_of(double px) const { return (px - state_.middle[0]) / state_.side_px; }
  double y_of(double px) const { return (px - state_.middle[1]) / state_.side_px; }

  BlockModel model(int column, int row, const Quadratic& u, const Quadratic& v, const Blur& blur) const {
    BlockModel m;
    m.x = kSide * column + kSide / 2;
    m.y = kSide * row + kSide / 2;
    m.u = q22(u);
    m.v = q22(v);
    const double start = scene_.cells.first(), end = scene_.cells.last() + 1;
    m.u_first = q18(std::max(first_, start + kFromEnd * blur.dev_u));
    m.u_last = q18(std::min(last(), end - kFromEnd * blur.dev_u));
    m.v_first = q18(std::max(first_, start + kFromEnd * blur.dev_v));
    m.v_last = q18(std::min(last(), end - kFromEnd * blur.dev_v));
    m.per_module_u = rounded(256 / blur.dev_u);
    m.per_module_v = rounded(256 / blur.dev_v);
    m.reach_u = q18(EdgeProfile::kReach * blur.dev_u);
    m.reach_v = q18(EdgeProfile::kReach * blur.dev_v);
    m.correlation = rounded(blur.correlation * 4096);
    m.half_square = rounded(blur.correlation * blur.correlation * 2048);
    m.tone = rounded(state_.tone * 4096);
    const double x = x_of(m.x), y = y_of(m.y), per_px = 8192 / state_.side_px;
    const auto& d = state_.dark;
    m.dark = {rounded((d[0] + d[1] * x + d[2] * y) * 8192), rounded(d[1] * per_px), rounded(d[2] * per_px)};
    const auto& c = state_.contrast;
    m.contrast = {rounded(contrast(x, y) * 8192), rounded((c[1] + 2 * c[3] * x + c[4] * y) * per_px),
                  rounded((c[2] + c[4] * x + 2 * c[5] * y) * per_px)};
    m.most_residual = rounded(state_.most_residual * 32);
    return m;
  }

 private:
  double last() const { return scene_.border - first_; }

  const FitScene& scene_;
  const FitState& state_;
  const MarkerMap& map_;
  double first_;
};

}  // namespace

bool FitPass::run(const FitScene& scene, const FitState& state, int row_step) {
  if (!map.set(scene.lens, state.corners, scene.border, 1)) return false;
  const Blocks blocks(scene, state, map);
  const Blocks::Range range = blocks.range();
  const double half = scene.border / 2;
  const int parts = state.side_px < kQuarters_px ? 4 : 1;
  BlockChannels channels;
  ChannelSums sums;
  for (int row = range.top; row <= range.bottom; ++row) {
    for (int column = range.left; column <= range.right; ++column) {
      Quadratic u, v;
      map.block(column, row, u, v);
      if (blocks.outside(u, v)) continue;
      const Blur blur(state.blur, u, v);
      const auto bend = [](const Quadratic& q) { return std::fabs(q.xx) + std::fabs(q.xy) + std::fabs(q.yy); };
      if (!(blur.dev_u < kMostBlur && blur.dev_v < kMostBlur && bend(u) < kMostBend && bend(v) < kMostBend)) {
        return false;
      }
      const BlockModel model = blocks.model(column, row, u, v, blur);
      fill_channels(scene.image, scene.cells, scene.profile, model, row_step, channels);
      saturated_ += channels.saturated;
      pixels += channels.pixels;
      even_ += channels.even;
      pairs_ += channels.pairs;
      even_squares_ += channels.even_squares;
      pair_products_ += channels.pair_products;
      if (channels.pixels == 0) continue;

      FitPlace place;
      place.steep_u = half / blur.dev_u;
      place.steep_v = half / blur.dev_v;
      for (std::size_t k = 0; k < 3; ++k) {
        place.wider_u[k] = blur.by_u[k] / (2 * blur.var_u);
        place.wider_v[k] = blur.by_v[k] / (2 * blur.var_v);
        place.twist[k] =
            blur.by_uv[k] / (blur.dev_u * blur.dev_v) - blur.correlation * (place.wider_u[k] + place.wider_v[k]);
      }
      for (int part = 0; part < parts; ++part) {
        // The middle of the pixels -4 … 3, or -4 … -1 and 0 … 3.
        const double dx = parts == 1 ? -0.5 : (part % 2 == 0 ? -2.5 : 1.5);
        const double dy = parts == 1 ? -0.5 : (part < 2 ? -2.5 : 1.5);
        place.x = blocks.x_of(model.x + dx);
        place.y = blocks.y_of(model.y + dy);
        place.a = (u.c + u.x * dx + u.y * dy) / half - 1;
        place.b = (v.c + v.x * dx + v.y * dy) / half - 1;
        place.contrast = blocks.contrast(place.x, place.y);
        const int count = 64 / parts;
        sum_products(channels, part * count, count, sums);
        normal.add(place, sums, channels.on_edges > 0);
      }
    }
  }
  // Where most is saturated, little is left that the model could be wrong about.
  return pixels >= kLeastPixels && pixels * 3 >= saturated_;
}

double FitPass::correlation() const {
  if (pairs_ < kLeastPairs || !(even_squares_ > 0)) return 0;
  return (pair_products_ / pairs_) / (even_squares_ / even_);
}

}  // namespace berth
