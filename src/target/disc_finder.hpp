#pragma once

#include <vector>

#include "berth/disc_target.hpp"
#include "target/disc_fit.hpp"
#include "target/disc_match.hpp"

namespace berth {

/// The targets of discs in a frame: from its contours to poses. All memory is taken in the constructor.
class DiscFinder {
 public:
  /// Round contours of a frame that are kept, and of those that are measured: the largest, from above, from the left.
  static constexpr std::size_t kMostOutlines = 512, kMostMeasured = 128;

  /// Throws Error where DiscTarget::check does, or two targets have one name.
  DiscFinder(const std::vector<DiscTarget>& targets, const CameraModel& camera);

  /// Begins a frame.
  void clear() { outlines_.clear(); }
  /// A contour of the frame (outline_ellipse), whatever it is of. Those that came before are the better ones.
  void add_outline(const u32* points, int count, int scale);
  /// Measures the frame's discs and finds each target; one result for each, in their order.
  void find(View2D<const u8> image, std::vector<DiscPose>& results);

  std::size_t targets() const { return matchers_.size(); }
  /// The discs of the frame last searched, largest first.
  const std::vector<FittedDisc>& discs() const { return discs_; }

 private:
  CameraModel camera_;
  DiscFit fit_;
  std::vector<DiscMatcher> matchers_;
  std::vector<Ellipse> outlines_;
  std::vector<FittedDisc> discs_;
};

}  // namespace berth
