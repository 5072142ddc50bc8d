#pragma once

#include <array>
#include <cstddef>

#include "berth/disc_target.hpp"

namespace berth {

/// For each disc of a target, which of a frame's it is; kNoDisc where none.
using DiscAssignment = std::array<int, DiscTarget::kMostDiscs>;
constexpr int kNoDisc = -1;

/// The ways to tell a target's discs in one frame apart, the best of them, and whether another is nearly as good. In
/// whatever order they come the answer is the same. All memory is its own.
class DiscChoice {
 public:
  /// Ways beyond are not taken.
  static constexpr std::size_t kMost = 64;

  /// A way with so many discs, whose centres' residuals have this sum of squares in standard deviations. Whether it is
  /// the best so far: more discs, or as many and a smaller sum.
  bool offer(const DiscAssignment& assignment, int used, double chi_square);
  bool empty() const { return count_ == 0; }
  /// Whether another way with as many discs fits nearly as well as the best, and takes for one disc of the target what
  /// that takes for another: where the disc that tells how a target is turned is hidden, the rest may fit in several
  /// ways.
  bool is_doubtful() const;

 private:
  struct Way {
    DiscAssignment assignment{};
    int used = 0;
    double chi_square = 0;
  };
  std::array<Way, kMost> ways_{};
  std::size_t count_ = 0, best_ = 0;
};

}  // namespace berth
