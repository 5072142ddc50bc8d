#pragma once

#include <array>

#include "berth/marker.hpp"
#include "berth/source.hpp"
#include "table/pose_error.hpp"

namespace berth::table {

/// Bounds of 95 % for the mean of `count` chi-squares, each over its own `freedom`, which makes 1 of an honest one.
std::array<double, 2> honest_bounds(int count, int freedom);

/// Errors in units of their own covariances (normalised estimation errors squared, Bar-Shalom), each mean over its
/// degrees of freedom: 1 where covariances are honest, above where they are too small.
class Consistency {
 public:
  /// A detection of the marker that `truth` is, its pose by that marker's size.
  void add(const Detection& detection, const TruthMarker& truth);

  int markers() const { return corners_.count(); }
  /// Those whose corners tell which of a plane's two poses it is; the covariance knows nothing of a wrong choice.
  int poses() const { return pose_.count(); }
  int ambiguous() const { return ambiguous_; }
  /// Root mean square distance of a corner from its true place, px.
  double corner_rms_px() const { return distance_px_.rms(); }
  /// Of the eight coordinates together.
  double corners() const { return corners_.mean(); }
  /// Of the six axes together, and of each alone.
  double pose() const { return pose_.mean(); }
  double axis(std::size_t i) const { return axes_[i].mean(); }
  /// Share of poses beyond the 95 % quantile of chi-square of six degrees of freedom.
  double outside() const { return pose_.count() > 0 ? outside_ / static_cast<double>(pose_.count()) : 0; }

 private:
  ErrorSum distance_px_, corners_, pose_;
  std::array<ErrorSum, 6> axes_;
  int ambiguous_ = 0, outside_ = 0;
};

}  // namespace berth::table
