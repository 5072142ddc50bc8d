#include "target/fit_pass.hpp"

#include <algorithm>
#include <cmath>

#include "target/block_models.hpp"

namespace berth {
namespace {

// The widest blur, deviations in modules: a pixel is compared with three by three modules, no more.
constexpr double kMostBlur = 0.6;
// Marker coordinates are quadratic in a block up to here, modules a pixel².
constexpr double kMostBend = 0.25;
constexpr int kLeastPixels = 60;
constexpr int kLeastPairs = 100;
// A place, in which the field's factors are taken as constant, is a quarter of a block in smaller markers than this,
// and four blocks in markers from that size on.
constexpr double kQuarters_px = 32, kFours_px = 88;
constexpr int kHalfSide = LensBlocks::kSide / 2;
// Measured on the corpora, with their coarsely rendered blurs and their shadows (docs/corners.md): what a small marker
// adds, what correlated levels add, and what places with levels of their own do. Unknowns that the pixels determine.
constexpr double kSmallSide_px = 15, kCorrelated = 15, kLocalTimes = 4.5, kFreedom = 17;
constexpr double kResidualScale = 256;  // squares of residuals, q8

// One block of a place.
struct Part {
  int column, row;
  Quadratic u, v;
};

double bend(const Quadratic& q) { return std::fabs(q.xx) + std::fabs(q.xy) + std::fabs(q.yy); }

// Blocks of a place: up to four, those taken that are not outside.
class Parts {
 public:
  void clear() { count_ = 0; }
  Part& next() { return parts_[count_]; }
  void keep() { ++count_; }
  bool empty() const { return count_ == 0; }
  const Part* begin() const { return parts_.data(); }
  const Part* end() const { return parts_.data() + count_; }
  // The mean of the parts: its constant and linear coefficients.
  Quadratic mean(Quadratic Part::*coordinate) const {
    Quadratic sum;
    for (const Part& part : *this) {
      const Quadratic& q = part.*coordinate;
      sum.c += q.c;
      sum.x += q.x;
      sum.y += q.y;
    }
    const double share = 1 / static_cast<double>(count_);
    return {sum.c * share, sum.x * share, sum.y * share, 0, 0, 0};
  }

 private:
  std::array<Part, 4> parts_;
  std::size_t count_ = 0;
};

// How a place of `parts` meets the sums: (dx, dy) off the middle of its blocks.
FitPlace place_of(const Parts& parts, const BlockModels& models, const AxesBlur& blur, const Quadratic& u,
                  const Quadratic& v, double half, double dx, double dy) {
  FitPlace place;
  place.steep_u = half / blur.dev_u;
  place.steep_v = half / blur.dev_v;
  for (std::size_t k = 0; k < 3; ++k) {
    place.wider_u[k] = blur.by_u[k] / (2 * blur.var_u);
    place.wider_v[k] = blur.by_v[k] / (2 * blur.var_v);
    place.twist[k] =
        blur.by_uv[k] / (blur.dev_u * blur.dev_v) - blur.correlation * (place.wider_u[k] + place.wider_v[k]);
  }
  double x = dx, y = dy;
  const double share = 1 / static_cast<double>(parts.end() - parts.begin());
  for (const Part& part : parts) {
    x += share * (LensBlocks::kSide * part.column + kHalfSide);
    y += share * (LensBlocks::kSide * part.row + kHalfSide);
  }
  place.x = models.x_of(x);
  place.y = models.y_of(y);
  place.a = (u.c + u.x * dx + u.y * dy) / half - 1;
  place.b = (v.c + v.x * dx + v.y * dy) / half - 1;
  place.contrast = models.contrast(place.x, place.y);
  return place;
}

}  // namespace

void FitPass::count(const PixelCounts& counts) {
  pixels += counts.pixels;
  saturated_ += counts.saturated;
  even_ += counts.even;
  pairs_ += counts.pairs;
  even_squares_ += counts.even_squares;
  pair_products_ += counts.pair_products;
}

bool FitPass::run(const FitScene& scene, const FitState& state, Share share) {
  if (!map.set(scene.lens, state.corners, scene.border, 1)) return false;
  BlockModels models(scene, state, map);
  const BlockModels::Range range = models.range();
  const double half = scene.border / 2;
  const bool in_quarters = state.side_px < kQuarters_px;
  const bool is_large = state.side_px >= kFours_px && tones_ == Tones::smooth;
  // A place is this many blocks wide. Of a quarter of the pixels it has as many as of all in one half as wide.
  const int step = (is_large ? 2 : 1) * (share == Share::quarter ? 2 : 1);
  const int row_step = share == Share::quarter && !is_large ? 2 : 1;
  const auto is_taken = [&](int column, int row) {
    if (share == Share::all) return true;
    // One block of every two by two, elsewhere in the next; or every second row of every second block.
    return is_large ? (column & 1) == (row >> 1 & 1) && (row & 1) == (column >> 1 & 1) : ((column + row) & 1) == 0;
  };
  BlockChannels channels;
  NodeBlock block;
  block.row_step = row_step;
  PlaceSums sums;
  Parts parts;
  // From even blocks on, so that no place has more than four that are taken.
  for (int top = range.top & ~1; top <= range.bottom; top += step) {
    for (int left = range.left & ~1; left <= range.right; left += step) {
      parts.clear();
      for (int row = top; row < top + step && row <= range.bottom; ++row) {
        for (int column = left; column < left + step && column <= range.right; ++column) {
          if (!is_taken(column, row)) continue;
          Part& part = parts.next();
          part.column = column;
          part.row = row;
          map.block(column, row, part.u, part.v);
          if (models.outside(part.u, part.v)) continue;
          if (!(bend(part.u) < kMostBend && bend(part.v) < kMostBend)) return false;
          parts.keep();
        }
      }
      if (parts.empty()) continue;
      const Quadratic u = parts.mean(&Part::u), v = parts.mean(&Part::v);
      const AxesBlur blur(state.blur, u, v);
      if (!(blur.dev_u < kMostBlur && blur.dev_v < kMostBlur)) return false;

      const bool by_nodes = !in_quarters && models.set_place(blur, block);
      sums.clear();
      for (const Part& part : parts) {
        if (by_nodes && models.set_block(part.column, part.row, part.u, part.v, block)) {
          add_block(scene.image, scene.profile.pieces(), block, sums);
          continue;
        }
        const BlockModel model = models.model(part.column, part.row, part.u, part.v, blur);
        fill_channels(scene.image, scene.cells, scene.profile, model, row_step, channels);
        if (in_quarters) {
          count(channels.counts);
          if (channels.counts.pixels == 0) break;
          // The middle of the pixels -4 … -1 and 0 … 3.
          for (int quarter = 0; quarter < 4; ++quarter) {
            const double dx = quarter % 2 == 0 ? -2.5 : 1.5, dy = quarter < 2 ? -2.5 : 1.5;
            sums.clear();
            add_products(channels, 16 * quarter, 16, sums);
            sums.add(channels.counts);
            normal.add(place_of(parts, models, blur, u, v, half, dx, dy), sums);
          }
          break;
        }
        add_products(channels, 0, 64, sums);
        sums.add(channels.counts);
      }
      if (in_quarters) continue;
      const PixelCounts counts = sums.counts();
      count(counts);
      // The middle of the pixels -4 … 3.
      if (counts.pixels > 0) {
        normal.add(place_of(parts, models, blur, u, v, half, -0.5, -0.5), sums);
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

double FitPass::excess(double side_px) const {
  const double small = kSmallSide_px / side_px;
  const double times = pixels / (pixels - kFreedom) * (1 + small * small);
  if (tones_ == Tones::local) return times * kLocalTimes;
  double at_edges = 1;
  if (even_ >= kLeastPairs && pixels > even_ && normal.squares() > 0) {
    const double share = (normal.squares() - even_squares_ / kResidualScale) / normal.squares();
    at_edges = std::max(1.0, share * pixels / (pixels - even_));
  }
  const double known = pairs_ > 0 ? 2 / std::sqrt(static_cast<double>(pairs_)) : 0;  // two deviations of no correlation
  return times * at_edges * (1 + kCorrelated * std::max(0.0, correlation() - known));
}

}  // namespace berth
