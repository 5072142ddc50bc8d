#pragma once

#include <array>
#include <cstddef>

#include "target/pattern_sums.hpp"

namespace berth {

/// The fit's unknowns, in this order.
enum Unknown : std::size_t {
  kDark = 0,       // grey level of dark: in the marker's middle, per unit of X, of Y
  kContrast = 3,   // from dark to light, likewise, and per unit of X², X Y, Y²: lenses darken their corners
  kToneCurve = 9,  // what P (1 - P) adds to P
  kField = 10,     // eight of the pattern's displacement, half sides: FitNormal
  kBlur = 18,      // variance in the image, px²: xx, xy, yy
  kUnknowns = 21
};

using FitVector = std::array<double, kUnknowns>;
using FitMatrix = std::array<double, kUnknowns * kUnknowns>;

/// A block, or a quarter of one, as the sums meet it: how its channels depend on the unknowns there.
struct FitPlace {
  /// X and Y, image coordinates about the marker's middle in units of its side; (a, b), marker coordinates about its
  /// middle, half sides.
  double x = 0, y = 0, a = 0, b = 0;
  /// Grey levels from dark to light, and the blur's deviations in half a side along u and v.
  double contrast = 0, steep_u = 0, steep_v = 0;
  /// d log deviation along u, along v, and d correlation, by the blur's three variances.
  std::array<double, 3> wider_u = {}, wider_v = {}, twist = {};
};

/// What dark and light look like: planes and a quadratic over the whole marker, or its own two levels in every place,
/// which follow the edge of a shadow and cost a part of the accuracy.
enum class Tones { smooth, local };

/// Sums of the normal equations: products of the unknowns' derivatives, of which the upper triangle counts, in rows
/// that are padded to whole vectors, and behind them those with the residuals; the residuals' squares.
struct FitEquations {
  static constexpr std::size_t kWidth = 24, kGradient = kUnknowns;
  using Row = std::array<double, kWidth>;
  alignas(64) std::array<Row, kUnknowns> rows = {};
  double squares = 0;

  FitVector gradient() const {
    FitVector column;
    for (std::size_t i = 0; i < kUnknowns; ++i) column[i] = rows[i][kGradient];
    return column;
  }
};

/// Normal equations of the fit, from integer sums that are added in a fixed order.
///
/// A displacement of the pattern is a projective vector field, (c0 + c1 a + c2 b + a w, c3 + c4 a + c5 b + b w) with
/// w = c6 a + c7 b: what eight corner coordinates can do. Within a place its factors are taken as constant.
class FitNormal {
 public:
  explicit FitNormal(Tones tones) : tones_(tones) {}

  void add(const FitPlace& place, const PlaceSums& sums);
  /// Pulls the sum of the unknowns times `factors`, now `value` away from where it is expected, with this weight.
  void add_prior(const FitVector& factors, double value, double weight);

  /// Sum of the residuals' squares, grey levels²; without each place's own levels where tones are local.
  double squares() const { return equations_.squares; }
  /// The step that makes the sum of squares least, of the levels alone or of all unknowns; those left out step 0.
  /// Returns false where it is not determined.
  /// `factor`: the equations' Cholesky factor, the lower triangle.
  bool solve_levels(FitVector& step) const;
  bool solve(FitVector& step, FitMatrix& factor) const;

 private:
  FitMatrix lower() const;

  Tones tones_;
  FitEquations equations_;
};

/// A linear function of the field's eight unknowns as a vector of which the products with another such vector are their
/// covariance, per grey level² of noise: the last unknowns of factor⁻¹ field, the others being 0.
std::array<double, kUnknowns - kField> whitened(const FitMatrix& factor, const std::array<double, 8>& field);

}  // namespace berth
