#include "target/fit_pass.hpp"

#include <algorithm>
#include <cmath>

#include "target/block_models.hpp"

namespace berth {
namespace {

// The widest blur, deviations in modules: a pixel is compared with three by three modules, no more.
constexpr double kMostBlur = 0.6;
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

// Blocks of a place: up to four, those taken that are not outside, as lanes of a group.
class Parts {
 public:
  explicit Parts(const BlockGroup& group) : group_(group) {}

  void clear() { count_ = 0; }
  void add(std::size_t lane) { lanes_[count_++] = lane; }
  bool empty() const { return count_ == 0; }
  const BlockGroup& group() const { return group_; }
  const std::size_t* begin() const { return lanes_.data(); }
  const std::size_t* end() const { return lanes_.data() + count_; }
  double share() const {
    constexpr double kShares[] = {0, 1, 1 / 2.0, 1 / 3.0, 1 / 4.0};
    return kShares[count_];
  }
  // The mean of the parts: its constant and linear coefficients.
  Quadratic mean(const BlockGroup::Coordinate& coordinate) const {
    Quadratic sum;
    for (const std::size_t lane : *this) {
      sum.c += coordinate.q[0][lane];
      sum.x += coordinate.q[1][lane];
      sum.y += coordinate.q[2][lane];
    }
    return {sum.c * share(), sum.x * share(), sum.y * share(), 0, 0, 0};
  }
  // Of one of them.
  std::array<double, 2> middle_px(std::size_t lane) const {
    return {LensBlocks::kSide * group_.columns[lane] + kHalfSide + 0.0,
            LensBlocks::kSide * group_.rows[lane] + kHalfSide + 0.0};
  }

 private:
  const BlockGroup& group_;
  std::array<std::size_t, BlockGroup::kMost> lanes_;
  std::size_t count_ = 0;
};

}  // namespace

void FitPass::count(const PixelCounts& counts) {
  pixels += counts.pixels;
  saturated_ += counts.saturated;
  even_ += counts.even;
  pairs_ += counts.pairs;
  even_squares_ += counts.even_squares;
  pair_products_ += counts.pair_products;
}

// The places of one look.
class FitPass::Places {
 public:
  Places(const FitScene& scene, const MarkerMap& map, const FitState& state, int row_step, FitPass& pass)
      : scene_(scene),
        state_(state),
        pass_(pass),
        models_(scene, state, map),
        half_(scene.border / 2),
        in_quarters_(state.side_px < kQuarters_px) {
    nodes_.place.row_step = row_step;
  }

  const BlockModels& models() const { return models_; }

  /// Adds a place to the equations; false where its blur is too wide.
  bool add(const Parts& parts) {
    const Quadratic u = parts.mean(parts.group().u), v = parts.mean(parts.group().v);
    const AxesBlur blur(state_.blur, u, v);
    if (!(blur.dev_u < kMostBlur && blur.dev_v < kMostBlur)) return false;
    if (in_quarters_) {
      add_quarters(parts, blur, u, v);
      return true;
    }
    const bool by_nodes = models_.set_place(blur, nodes_.place);
    sums_.clear();
    nodes_.count = 0;
    for (const std::size_t lane : parts) {
      if (by_nodes && models_.set_block(parts.group(), lane, nodes_.blocks[nodes_.count])) {
        ++nodes_.count;
        continue;
      }
      fill(parts, lane, blur);
      add_products(channels_, 0, 64, sums_);
      sums_.add(channels_.counts);
    }
    if (nodes_.count > 0) add_blocks(scene_.image, scene_.profile.pieces(), nodes_, sums_);
    const PixelCounts counts = sums_.counts();
    pass_.count(counts);
    // The middle of the pixels -4 … 3.
    if (counts.pixels > 0) pass_.normal.add(place_of(parts, blur, u, v, -0.5, -0.5), sums_);
    return true;
  }

 private:
  void fill(const Parts& parts, std::size_t lane, const AxesBlur& blur) {
    const BlockModel model = models_.model(parts.group(), lane, blur);
    fill_channels(scene_.image, scene_.cells, scene_.profile, model, nodes_.place.row_step, channels_);
  }

  // Of one block.
  void add_quarters(const Parts& parts, const AxesBlur& blur, const Quadratic& u, const Quadratic& v) {
    fill(parts, *parts.begin(), blur);
    pass_.count(channels_.counts);
    if (channels_.counts.pixels == 0) return;
    // The middle of the pixels -4 … -1 and 0 … 3.
    for (int quarter = 0; quarter < 4; ++quarter) {
      const double dx = quarter % 2 == 0 ? -2.5 : 1.5, dy = quarter < 2 ? -2.5 : 1.5;
      sums_.clear();
      add_products(channels_, 16 * quarter, 16, sums_);
      sums_.add(channels_.counts);
      pass_.normal.add(place_of(parts, blur, u, v, dx, dy), sums_);
    }
  }

  // How a place of `parts` meets the sums: (dx, dy) off the middle of its blocks.
  FitPlace place_of(const Parts& parts, const AxesBlur& blur, const Quadratic& u, const Quadratic& v, double dx,
                    double dy) const {
    FitPlace place;
    place.steep_u = half_ / blur.dev_u;
    place.steep_v = half_ / blur.dev_v;
    for (std::size_t k = 0; k < 3; ++k) {
      place.wider_u[k] = blur.by_u[k] / (2 * blur.var_u);
      place.wider_v[k] = blur.by_v[k] / (2 * blur.var_v);
      place.twist[k] =
          blur.by_uv[k] / (blur.dev_u * blur.dev_v) - blur.correlation * (place.wider_u[k] + place.wider_v[k]);
    }
    double x = dx, y = dy;
    for (const std::size_t lane : parts) {
      x += parts.share() * parts.middle_px(lane)[0];
      y += parts.share() * parts.middle_px(lane)[1];
    }
    place.x = models_.x_of(x);
    place.y = models_.y_of(y);
    place.a = (u.c + u.x * dx + u.y * dy) / half_ - 1;
    place.b = (v.c + v.x * dx + v.y * dy) / half_ - 1;
    place.contrast = models_.contrast(place.x, place.y);
    return place;
  }

  const FitScene& scene_;
  const FitState& state_;
  FitPass& pass_;
  BlockModels models_;
  double half_;
  bool in_quarters_;
  BlockChannels channels_;
  NodeBlocks nodes_;
  PlaceSums sums_;
};

bool FitPass::run(const FitScene& scene, const MarkerMap& map, const FitState& state, Share share) {
  const bool is_large = state.side_px >= kFours_px && tones_ == Tones::smooth;
  // A place is this many blocks wide. Of a quarter of the pixels it has as many as of all in one half as wide.
  const int step = (is_large ? 2 : 1) * (share == Share::quarter ? 2 : 1);
  const int row_step = share == Share::quarter && !is_large ? 2 : 1;
  const auto is_taken = [&](int column, int row) {
    if (share == Share::all) return true;
    // One block of every two by two, elsewhere in the next; or every second row of every second block.
    return is_large ? (column & 1) == (row >> 1 & 1) && (row & 1) == (column >> 1 & 1) : ((column + row) & 1) == 0;
  };
  Places places(scene, map, state, row_step, *this);
  const BlockModels::Range range = places.models().range();
  // Places of single blocks are looked at four at a time.
  const int across = step == 1 ? static_cast<int>(BlockGroup::kMost) : step;
  BlockGroup group;
  Parts parts(group);
  // From even blocks on, so that no place has more than four that are taken.
  for (int top = range.top & ~1; top <= range.bottom; top += step) {
    for (int left = range.left & ~1; left <= range.right; left += across) {
      group.clear();
      for (int row = top; row < top + step && row <= range.bottom; ++row) {
        for (int column = left; column < left + across && column <= range.right; ++column) {
          if (is_taken(column, row)) group.add(column, row);
        }
      }
      if (group.count == 0) continue;
      places.models().fill(group);
      parts.clear();
      for (std::size_t lane = 0; lane < group.count; ++lane) {
        if ((group.outside >> lane & 1) != 0) continue;
        if ((group.bent >> lane & 1) != 0) return false;
        parts.add(lane);
        if (step > 1) continue;
        if (!places.add(parts)) return false;
        parts.clear();
      }
      if (!parts.empty() && !places.add(parts)) return false;
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
