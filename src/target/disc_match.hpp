#pragma once

#include <array>
#include <cstddef>

#include "berth/disc_target.hpp"
#include "berth/image.hpp"
#include "target/disc_choice.hpp"
#include "target/disc_pose.hpp"

namespace berth {

/// Finds one target among a frame's discs (docs/disc-targets.md): which is which, and from that the pose. All memory is
/// its own; bounded loops; the same bits on every machine.
class DiscMatcher {
 public:
  /// No more discs of a frame are considered than this.
  static constexpr std::size_t kMostSeen = 64;

  /// Throws Error where DiscTarget::check does.
  explicit DiscMatcher(const DiscTarget& target);

  const DiscTarget& target() const { return target_; }

  /// `discs` are a frame's, in an order that the frame alone decides; those after kMostSeen are not considered.
  void find(const CameraModel& camera, View2D<const u8> image, const FittedDisc* discs, std::size_t count,
            DiscPose& result);

 private:
  struct Solution {
    DiscAssignment assignment{};
    int used = 0;
    RefinedPose pose, other;
    bool has_other = false;
  };

  bool may_be(std::size_t disc, std::size_t seen) const;
  bool assign_from(std::size_t i, std::size_t j, std::size_t k, std::size_t l, DiscAssignment& assignment);
  bool is_known(const DiscAssignment& assignment);
  std::size_t gather(const DiscAssignment& assignment, std::array<SeenDisc, DiscTarget::kMostDiscs>& discs) const;
  bool solve(const DiscAssignment& assignment, RefinedPose& best, RefinedPose& other, bool& has_other) const;
  bool assign_at(const Pose& pose, DiscAssignment& assignment) const;
  struct Levels {
    double dark = 0, light = 0;
  };
  bool mean_levels(const Solution& solution, Levels& levels) const;
  bool looks_right(const CameraModel& camera, View2D<const u8> image, const Solution& solution) const;
  bool attempt(const CameraModel& camera, View2D<const u8> image, const DiscAssignment& start,
               Solution& solution) const;

  DiscTarget target_;
  /// Squares of the distances between the target's centres, m^2, and of each to its nearest.
  std::array<std::array<double, DiscTarget::kMostDiscs>, DiscTarget::kMostDiscs> squares_m2_{};
  std::array<double, DiscTarget::kMostDiscs> nearest_m2_{};
  const FittedDisc* seen_ = nullptr;
  std::size_t count_ = 0;
  std::array<DiscAssignment, DiscChoice::kMost> tried_{};
  std::size_t tried_count_ = 0;
  /// Pairs of the frame that have been followed up.
  int pairs_ = 0;
};

}  // namespace berth
