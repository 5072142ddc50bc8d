#pragma once

#include "berth/types.hpp"
#include "exact_math.hpp"

namespace berth::sim {

/// Steele, Lea & Flood 2014: one round of SplitMix64, a bijection that scatters neighbouring numbers.
inline u64 scatter(u64 x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// A number in [0, 1) from the high 53 bits.
inline double unit(u64 bits) { return static_cast<double>(bits >> 11) * (1.0 / 9007199254740992.0); }

/// A sequence of random numbers that is the same everywhere: a hash of (seed, count).
class Random {
 public:
  explicit Random(u64 seed) : key_(scatter(seed)) {}

  u64 bits() { return scatter(key_ ^ scatter(count_++)); }
  double uniform(double low, double high) { return low + (high - low) * unit(bits()); }
  /// An integer, both ends included.
  int integer(int low, int high) {
    const auto range = static_cast<u64>(static_cast<long long>(high) - low + 1);
    return low + static_cast<int>(bits() % range);
  }
  bool chance(double probability) { return unit(bits()) < probability; }

 private:
  u64 key_;
  u64 count_ = 0;
};

}  // namespace berth::sim
