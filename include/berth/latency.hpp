#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "berth/types.hpp"

namespace berth {

/// How often which time was taken, in fixed memory: exact below 256 ns, then 128 buckets an octave (within 0.8 %) to
/// 18 minutes, as HdrHistogram lays them out. One thread adds, any may read or copy at the same time: each count is
/// whole then, but the counts may lie a frame apart.
class LatencyHistogram {
 public:
  LatencyHistogram() = default;
  LatencyHistogram(const LatencyHistogram& other) { *this = other; }
  LatencyHistogram& operator=(const LatencyHistogram& other);

  /// Below 0 counts as 0; above the last bucket as the last, but for max().
  void add(std::int64_t ns);
  /// As if all that the other was given had been given to this one.
  void merge(const LatencyHistogram& other);
  void clear() { *this = LatencyHistogram(); }

  u64 count() const { return count_.load(std::memory_order_relaxed); }
  std::int64_t max() const { return max_.load(std::memory_order_relaxed); }
  /// The least time, as far as buckets tell from above, that this share of all did not exceed; quantile(0.5) is the
  /// median. Never above max(); 0 where there is none.
  std::int64_t quantile(double share) const;

  /// The bucket of a time, and the longest time that it holds.
  static std::size_t bucket_of(std::int64_t ns);
  static std::int64_t upper_end(std::size_t bucket);

 private:
  static constexpr int kOctaves = 32;
  static constexpr std::size_t kExact = 256, kAnOctave = 128;

  std::array<std::atomic<u64>, kExact + kAnOctave* kOctaves> counts_ = {};
  std::atomic<u64> count_ = 0;
  std::atomic<std::int64_t> max_ = 0;
};

}  // namespace berth
