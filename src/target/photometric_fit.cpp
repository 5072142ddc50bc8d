#include "target/photometric_fit.hpp"

#include <algorithm>
#include <cmath>

#include "target/first_levels.hpp"
#include "target/fit_normal.hpp"
#include "target/fit_pass.hpp"

namespace berth {
namespace {

constexpr int kMostPasses = 10;
// Passes after which levels that are not smooth are taken for what keeps the steps from ending.
constexpr int kPatience = 4;
// While the blur changes by little, the next step is some twentieth of the one before, if that is a small part of the
// blur. So a step below this many of the deviations that the noise leaves open, within these bounds, is the last if it
// changes the blur's variance by a share below that.
constexpr double kLastStepDeviations = 6;
constexpr double kLastStepFrom_px = 0.01, kLastStepTo_px = 0.03;
constexpr double kLeastBlurChange = 0.1;
// Corners that are known no better than this are not worth having, px.
constexpr double kMostDeviation_px = 1;
// Smaller markers have no pixels to spare for the first passes, px.
constexpr double kSmall_px = 48;
// Nor are the modules' middles of smaller ones free of blur, px.
constexpr double kSampled_px = 32;
// Steps beyond are no refinement, px; nor are corners further from where they began than this, modules.
constexpr double kMostStep_px = 3;
constexpr double kMostChange_modules = 0.75;

// Neighbouring residuals away from edges that agree this much are not noise: the levels are not smooth, as at the edge
// of a shadow. Other frames of the corpora have less than 0.25, those across a shadow more than 0.3.
constexpr double kMostCorrelation = 0.25;

// Expected of what the pixels may not tell: no bent tone curve, the same blur in all directions, give or take this.
constexpr double kToneDeviation = 0.3;
constexpr double kBlurDeviation_px2 = 0.5;

// Residuals beyond this are not of the marker (a glint, a cable), in standard deviations and at least in grey levels.
constexpr double kMostDeviations = 5;
constexpr double kLeastLimit = 16, kMostLimit = 127;
constexpr double kMostLevel = 1024;
constexpr double kLeastContrast = 4;
constexpr double kMostTone = 0.9;
constexpr double kLeastNoise = 0.1;  // grey levels²: about what rounding to integers makes

// The paper's order to clockwise and back: upper left, lower left, lower right, upper right.
Corners turned_round(const Corners& corners) { return {corners[0], corners[3], corners[2], corners[1]}; }
CornerCovariance turned_round(const CornerCovariance& covariance) {
  constexpr std::array<std::size_t, 8> kFrom = {0, 1, 6, 7, 4, 5, 2, 3};
  CornerCovariance turned;
  for (std::size_t i = 0; i < 64; ++i) turned[i] = covariance[8 * kFrom[i / 8] + kFrom[i % 8]];
  return turned;
}

// Moves levels and tone curve; false where they are out of all bounds.
bool move_levels(const FitVector& step, FitState& state) {
  bool sound = true;
  for (std::size_t k = 0; k < 3; ++k) state.dark[k] += step[kDark + k];
  for (std::size_t k = 0; k < 6; ++k) state.contrast[k] += step[kContrast + k];
  for (const double level : state.dark) sound = sound && std::fabs(level) < kMostLevel;
  for (const double level : state.contrast) sound = sound && std::fabs(level) < kMostLevel;
  state.tone = std::min(kMostTone, std::max(-kMostTone, state.tone + step[kToneCurve]));
  return sound && state.contrast[0] > kLeastContrast;
}

// Moves the blur by as much of the step as leaves it an ellipse that is neither flat nor much smaller than before.
void move_blur(const FitVector& step, std::array<double, 3>& blur) {
  constexpr double kLeast_px2 = 0.03, kMostShrink = 0.4, kMostFlat = 0.8;
  double share = 1;
  for (int attempt = 0; attempt < 6; ++attempt, share /= 2) {
    std::array<double, 3> next;
    for (std::size_t k = 0; k < 3; ++k) next[k] = blur[k] + share * step[kBlur + k];
    if (!(next[0] > std::max(kLeast_px2, kMostShrink * blur[0]))) continue;
    if (!(next[2] > std::max(kLeast_px2, kMostShrink * blur[2]))) continue;
    if (!(next[1] * next[1] < kMostFlat * next[0] * next[2])) continue;
    blur = next;
    return;
  }
}

// How the corners, clockwise, depend on the pattern's displacement: px by half sides.
using FieldToCorners = std::array<std::array<double, 8>, 8>;

FieldToCorners corners_of_field(const MarkerMap& map, double border) {
  FieldToCorners result;
  for (std::size_t i = 0; i < 4; ++i) {
    const double a = i == 1 || i == 2 ? 1 : -1, b = i >= 2 ? 1 : -1;
    const double half = border / 2;
    std::array<double, 4> d{};
    map.at((a + 1) * half, (b + 1) * half, d);
    const double field_u[8] = {1, a, b, 0, 0, 0, 1, a * b}, field_v[8] = {0, 0, 0, 1, a, b, a * b, 1};
    for (std::size_t k = 0; k < 8; ++k) {
      result[2 * i][k] = (d[0] * field_u[k] + d[1] * field_v[k]) * half;
      result[2 * i + 1][k] = (d[2] * field_u[k] + d[3] * field_v[k]) * half;
    }
  }
  return result;
}

double side_of(const Corners& corners) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double dx = corners[(i + 1) & 3][0] - corners[i][0], dy = corners[(i + 1) & 3][1] - corners[i][1];
    sum += std::sqrt(dx * dx + dy * dy) / 4;
  }
  return sum;
}

double farthest(const Corners& a, const Corners& b) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double dx = a[i][0] - b[i][0], dy = a[i][1] - b[i][1];
    most = std::max(most, std::sqrt(dx * dx + dy * dy));
  }
  return most;
}

// A straight tone curve and a round blur, as far as the pixels do not tell otherwise.
void add_priors(const FitState& state, double noise, FitNormal& normal) {
  FitVector tone{}, mixed{}, difference{};
  tone[kToneCurve] = mixed[kBlur + 1] = difference[kBlur] = 1;
  difference[kBlur + 2] = -1;
  const double blur_weight = noise / (kBlurDeviation_px2 * kBlurDeviation_px2);
  normal.add_prior(tone, state.tone, noise / (kToneDeviation * kToneDeviation));
  normal.add_prior(mixed, state.blur[1], blur_weight);
  normal.add_prior(difference, state.blur[0] - state.blur[2], blur_weight);
}

// Solves a pass' normal equations and moves the state. Returns false where the step leads nowhere.
class Step {
 public:
  Step(const FitPass& pass, const MarkerMap& map, double border, FitState& state)
      : pass_(pass), map_(map), border_(border), state_(state) {}

  bool take() {
    FitNormal normal = pass_.normal;
    noise_ = std::max(kLeastNoise, normal.squares() / pass_.pixels);
    add_priors(state_, noise_, normal);
    FitVector step;
    FitMatrix factor;
    if (!normal.solve(step, factor) || !move_levels(step, state_)) return false;
    const double trace = state_.blur[0] + state_.blur[2];
    move_blur(step, state_.blur);
    blur_change_ = std::fabs(state_.blur[0] + state_.blur[2] - trace) / trace;
    const FieldToCorners corners = corners_of_field(map_, border_);
    const Corners before = state_.corners;
    double variances = 0;
    std::array<std::array<double, kUnknowns - kField>, 8> white;
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t k = 0; k < 8; ++k) state_.corners[i / 2][i % 2] += corners[i][k] * step[kField + k];
      white[i] = whitened(factor, corners[i]);
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k < white[i].size(); ++k) sum += noise_ * white[i][k] * white[j][k];
        covariance_px2_[8 * i + j] = covariance_px2_[8 * j + i] = sum;
      }
      variances += covariance_px2_[9 * i];
    }
    moved_px_ = farthest(before, state_.corners);
    deviation_px_ = std::sqrt(variances / 4);
    return moved_px_ < kMostStep_px && deviation_px_ < kMostDeviation_px;
  }

  bool is_last() const {
    const double most = std::min(kLastStepTo_px, std::max(kLastStepFrom_px, kLastStepDeviations * deviation_px_));
    return moved_px_ < most && blur_change_ < kLeastBlurChange;
  }
  /// Variance of a residual, grey levels².
  double noise() const { return noise_; }
  /// Of the corners, clockwise.
  const CornerCovariance& covariance_px2() const { return covariance_px2_; }

 private:
  const FitPass& pass_;
  const MarkerMap& map_;
  double border_;
  FitState& state_;
  double noise_ = 0, moved_px_ = 0, deviation_px_ = 0, blur_change_ = 0;
  CornerCovariance covariance_px2_ = {};
};

}  // namespace

bool PhotometricFit::refine(View2D<const u8> image, const MarkerFamily& family, int id, Corners& corners,
                            CornerCovariance& covariance_px2, CornerFit& fit) {
  cells_.set(family, id);
  FitState state;
  state.corners = turned_round(corners);
  state.side_px = side_of(state.corners);
  for (const auto& corner : state.corners) {
    for (std::size_t axis = 0; axis < 2; ++axis) state.middle[axis] += corner[axis] / 4;
  }
  const FitScene scene{image, lens_, profile_, cells_, static_cast<double>(family.border_width)};

  MarkerMap map;
  const auto set_map = [&] { return map.set(lens_, state.corners, scene.border, 1); };
  if (!set_map()) return false;
  const bool small = state.side_px < kSmall_px;
  FitPass pass(Tones::smooth);
  if (state.side_px < kSampled_px || !first_levels(scene, map, state)) {
    // Levels alone from all pixels, and from mid-grey, so that no residual is beyond 128.
    state.dark[0] = 128;
    FitVector step;
    if (!pass.run(scene, map, state, small ? FitPass::Share::all : FitPass::Share::quarter) ||
        !pass.normal.solve_levels(step) || !move_levels(step, state)) {
      return false;
    }
  } else if (!(state.contrast[0] > kLeastContrast)) {
    return false;
  }

  Tones tones = Tones::smooth;
  state.most_residual = kMostLimit;
  for (int k = 0; k < kMostPasses; ++k) {
    // The first step is long and need not be exact.
    const FitPass::Share share = k == 0 && !small ? FitPass::Share::quarter : FitPass::Share::all;
    pass = FitPass(tones);
    if ((k > 0 && !set_map()) || !pass.run(scene, map, state, share)) return false;
    Step next(pass, map, scene.border, state);
    if (!next.take()) return false;
    if (farthest(state.corners, turned_round(corners)) * scene.border > kMostChange_modules * state.side_px)
      return false;
    const bool last = next.is_last() && share == FitPass::Share::all;
    if (tones == Tones::smooth && (last || k >= kPatience) && pass.correlation() > kMostCorrelation) {
      tones = Tones::local;
      state.most_residual = kMostLimit;
      continue;
    }
    if (last) {
      corners = turned_round(state.corners);
      covariance_px2 = turned_round(next.covariance_px2());
      const double excess = pass.excess(state.side_px);
      for (double& value : covariance_px2) value *= excess;
      fit.noise = std::sqrt(next.noise());
      fit.blur_px2 = state.blur;
      fit.local_levels = tones == Tones::local;
      return true;
    }
    if (tones == Tones::smooth) {
      state.most_residual = std::min(kMostLimit, std::max(kLeastLimit, kMostDeviations * std::sqrt(next.noise())));
    }
  }
  return false;
}

}  // namespace berth
