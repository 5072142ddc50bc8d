#pragma once

#include <array>
#include <cstdint>

namespace berth {

/// One place on a blurred edge from dark (0) to light (1), t standard deviations of the blur past it; all q14.
struct EdgePoint {
  /// The normal distribution at t.
  std::int16_t level;
  /// Its derivative by t.
  std::int16_t slope;
  /// t times that: by how much the level falls for a blur that is wider by a share of one.
  std::int16_t spread;
};

/// Twice the normal distribution between 0 and t as a cubic in each of eight pieces half a deviation long, value and
/// slope continuous: coefficients of 1, f, f², f³ for the piece's part f behind, q15. Below 2^15 throughout.
using EdgePieces = std::array<std::array<std::int16_t, 8>, 4>;

/// A step edge under Gaussian blur, tabulated at every 1/128 of a standard deviation. Rounded from doubles that are
/// made of + - * / alone, so that the table has the same bits on every machine.
class EdgeProfile {
 public:
  static constexpr int kPerDeviation_bits = 7;
  /// Beyond this many deviations an edge is over: its level is 0 or 1 within the table's last bit.
  static constexpr int kReach = 4;

  EdgeProfile();
  /// -512 <= t_q7 <= 512.
  const EdgePoint& at(int t_q7) const { return points_[static_cast<std::size_t>(t_q7 + kMiddle)]; }
  const EdgePieces& pieces() const { return pieces_; }

 private:
  static constexpr int kMiddle = kReach << kPerDeviation_bits;
  std::array<EdgePoint, 2 * kMiddle + 1> points_;
  alignas(16) EdgePieces pieces_;
};

}  // namespace berth
