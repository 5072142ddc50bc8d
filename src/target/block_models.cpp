#include "target/block_models.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace berth {
namespace {

constexpr int kSide = LensBlocks::kSide;

// Modules outside the border where pixels still count, of the one that is light; pixels count where the pattern's end
// is this many deviations of the blur away, too.
constexpr double kOutside = 0.8;
constexpr double kFromEnd = 1.2;
// A module this many deviations of the blur wide hides its far edge from every pixel: at mid-module it is over but for
// 0.0013 of the contrast.
constexpr double kWideModule = 6;

// To the nearest, without a branch; below 2^29 in size. The cast rounds towards zero, so it is given what is positive.
int rounded(double value) {
  constexpr int kAbove = 1 << 29;
  return static_cast<int>(value + (kAbove + 0.5)) - kAbove;
}
int q18(double modules) { return rounded(modules * (1 << 18)); }
int q16(double modules) { return rounded(modules * (1 << 16)); }
std::int16_t q15(double value) { return static_cast<std::int16_t>(rounded(std::min(32767.0, value * 32768))); }

std::array<int, 6> q22(const Quadratic& q) {
  constexpr double k = 1 << 22;
  return {rounded(q.c * k),  rounded(q.x * k),  rounded(q.y * k),
          rounded(q.xx * k), rounded(q.xy * k), rounded(q.yy * k)};
}

// A coordinate of a block that fits: below four modules in all, |x| + |y| + 4 (|xx| + |xy| + |yy|) is below 2^15.
NodeCoordinate node_coordinate(const BlockGroup::Coordinate& from, std::size_t lane) {
  const auto slope = [&](std::size_t k) { return static_cast<std::int16_t>(from.slopes[k][lane]); };
  return {from.start[lane], {slope(0), slope(1), slope(2), slope(3), slope(4)}};
}

void set_gain(double deviation, std::int16_t& gain, int& doublings) {
  double eighth = 1 / (8 * deviation);
  for (doublings = 0; eighth >= 1; ++doublings) eighth /= 2;
  gain = q15(eighth);
}

// The pattern has two nodes more than its cells on either side; further off, no pixel counts.
void set_nodes(const PatternCells& cells, int column, int row, NodeBlock& block) {
  const PatternNodes& from = cells.nodes();
  NodeBlock::Nodes& to = block.nodes;
  std::uint32_t all_known = ~std::uint32_t{0};
  if (column >= cells.first() - 2 && column <= cells.last() && row >= cells.first() - 2 && row <= cells.last()) {
    for (std::size_t j = 0; j < 4; ++j) {
      const std::size_t node = cells.node(column, row + static_cast<int>(j));
      std::memcpy(&to.even[4 * j], &from.even[node], 4);
      std::memcpy(&to.by_u[4 * j], &from.by_u[node], 4);
      std::memcpy(&to.by_v[4 * j], &from.by_v[node], 4);
      std::memcpy(&to.both[4 * j], &from.both[node], 4);
      std::memcpy(&to.known[4 * j], &from.known[node], 4);
      std::uint32_t known = 0;
      std::memcpy(&known, &from.known[node], 4);
      all_known &= known;
    }
    block.all_known = all_known == ~std::uint32_t{0};
    return;
  }
  const auto inside = [&](int i) { return std::min(cells.last() + 3, std::max(cells.first() - 2, i)); };
  for (int k = 0; k < 16; ++k) {
    const std::size_t at = static_cast<std::size_t>(k), node = cells.node(inside(column + k % 4), inside(row + k / 4));
    to.even[at] = from.even[node];
    to.by_u[at] = from.by_u[node];
    to.by_v[at] = from.by_v[node];
    to.both[at] = from.both[node];
    to.known[at] = from.known[node];
  }
  block.all_known = false;
}

}  // namespace

AxesBlur::AxesBlur(const std::array<double, 3>& s, const Quadratic& u, const Quadratic& v)
    : by_u{u.x * u.x, 2 * u.x * u.y, u.y * u.y},
      by_v{v.x * v.x, 2 * v.x * v.y, v.y * v.y},
      var_u(by_u[0] * s[0] + by_u[1] * s[1] + by_u[2] * s[2]),
      var_v(by_v[0] * s[0] + by_v[1] * s[1] + by_v[2] * s[2]),
      dev_u(std::sqrt(var_u)),
      dev_v(std::sqrt(var_v)),
      by_uv{u.x * v.x, u.x * v.y + u.y * v.x, u.y * v.y},
      correlation((by_uv[0] * s[0] + by_uv[1] * s[1] + by_uv[2] * s[2]) / (dev_u * dev_v)) {}

BlockModels::BlockModels(const FitScene& scene, const FitState& state, const MarkerMap& map)
    : scene_(scene),
      state_(state),
      map_(map),
      first_(std::max(-kOutside, 1.0 * scene.cells.first())),
      per_side_(1 / state.side_px),
      source_{map.back(), first_, last(), state.dark, state.contrast, state.middle, per_side_} {}

BlockModels::Range BlockModels::range() const {
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

double BlockModels::contrast(double x, double y) const {
  const auto& c = state_.contrast;
  return c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
}

BlockModels::Limits BlockModels::limits(double deviation) const {
  const double start = scene_.cells.first(), end = scene_.cells.last() + 1;
  return {std::max(first_, start + kFromEnd * deviation), std::min(last(), end - kFromEnd * deviation)};
}

BlockModel BlockModels::model(const BlockGroup& group, std::size_t lane, const AxesBlur& blur) const {
  BlockModel m;
  m.x = kSide * group.columns[lane] + kSide / 2;
  m.y = kSide * group.rows[lane] + kSide / 2;
  m.u = q22(group.u.at(lane));
  m.v = q22(group.v.at(lane));
  const Limits limits_u = limits(blur.dev_u), limits_v = limits(blur.dev_v);
  m.u_first = q18(limits_u.first);
  m.u_last = q18(limits_u.last);
  m.v_first = q18(limits_v.first);
  m.v_last = q18(limits_v.last);
  m.per_module_u = rounded(256 / blur.dev_u);
  m.per_module_v = rounded(256 / blur.dev_v);
  m.reach_u = q18(EdgeProfile::kReach * blur.dev_u);
  m.reach_v = q18(EdgeProfile::kReach * blur.dev_v);
  m.correlation = rounded(blur.correlation * 4096);
  m.half_square = rounded(blur.correlation * blur.correlation * 2048);
  m.tone = rounded(state_.tone * 4096);
  const double x = x_of(m.x), y = y_of(m.y), per_px = 8192 * per_side_;
  const auto& d = state_.dark;
  m.dark = {rounded((d[0] + d[1] * x + d[2] * y) * 8192), rounded(d[1] * per_px), rounded(d[2] * per_px)};
  const auto& c = state_.contrast;
  m.contrast = {rounded(contrast(x, y) * 8192), rounded((c[1] + 2 * c[3] * x + c[4] * y) * per_px),
                rounded((c[2] + c[4] * x + 2 * c[5] * y) * per_px)};
  m.most_residual = rounded(state_.most_residual * 16);
  return m;
}

bool BlockModels::set_place(const AxesBlur& blur, NodePlace& place) {
  if (blur.dev_u * kWideModule > 1 || blur.dev_v * kWideModule > 1) return false;
  limits_u_ = limits(blur.dev_u);
  limits_v_ = limits(blur.dev_v);
  set_gain(blur.dev_u, place.gain_u, place.doublings_u);
  set_gain(blur.dev_v, place.gain_v, place.doublings_v);
  place.correlation = q15(blur.correlation);
  place.half_square = q15(blur.correlation * blur.correlation / 2);
  place.tone = q15(state_.tone);
  place.most_residual = static_cast<std::int16_t>(rounded(std::min(127.0, state_.most_residual) * 16));
  return true;
}

bool BlockModels::set_block(const BlockGroup& group, std::size_t lane, NodeBlock& block) const {
  const auto q9_step = [&](double a_side) { return static_cast<std::int16_t>(rounded(a_side * per_side_ * 512)); };
  block.x = kSide * group.columns[lane] + kSide / 2;
  block.y = kSide * group.rows[lane] + kSide / 2;
  if (block.x + kSide / 2 > scene_.image.width || block.y + kSide / 2 > scene_.image.height) return false;
  if ((group.fits >> lane & 1) == 0) return false;
  block.dark = group.dark[lane];
  block.contrast = group.contrast[lane];
  block.dark_step = {q9_step(state_.dark[1]), q9_step(state_.dark[2])};
  block.contrast_step = {static_cast<std::int16_t>(group.contrast_x[lane]),
                         static_cast<std::int16_t>(group.contrast_y[lane])};

  block.u = node_coordinate(group.u, lane);
  block.v = node_coordinate(group.v, lane);
  const int first_u = group.u.first[lane], first_v = group.v.first[lane];
  block.whole = group.u.low[lane] >= limits_u_.first && group.u.high[lane] < limits_u_.last &&
                group.v.low[lane] >= limits_v_.first && group.v.high[lane] < limits_v_.last;
  if (!block.whole) {
    block.u_first = q16(limits_u_.first - first_u + 0.5);
    block.u_last = q16(limits_u_.last - first_u + 0.5);
    block.v_first = q16(limits_v_.first - first_v + 0.5);
    block.v_last = q16(limits_v_.last - first_v + 0.5);
  } else {
    block.u_first = block.v_first = 0;
    block.u_last = block.v_last = 4 << 16;
  }
  set_nodes(scene_.cells, first_u, first_v, block);
  return true;
}

}  // namespace berth
