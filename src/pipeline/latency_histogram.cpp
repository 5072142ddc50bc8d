#include <algorithm>
#include <cmath>

#include "berth/latency.hpp"

namespace berth {
namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;

/// With a single thread that adds there is nothing to lock.
template <class T>
void raise(std::atomic<T>& value, T by) {
  value.store(value.load(kRelaxed) + by, kRelaxed);
}

}  // namespace

std::size_t LatencyHistogram::bucket_of(std::int64_t ns) {
  u64 value = ns < 0 ? 0 : static_cast<u64>(ns);
  if (value < kExact) return static_cast<std::size_t>(value);
  std::size_t octave = 0;  // above the exact ones
  for (; value >= kExact; value >>= 1) ++octave;
  if (octave > kOctaves) return kExact + kAnOctave * kOctaves - 1;
  return kExact + kAnOctave * (octave - 1) + static_cast<std::size_t>(value) - kAnOctave;
}

std::int64_t LatencyHistogram::upper_end(std::size_t bucket) {
  if (bucket < kExact) return static_cast<std::int64_t>(bucket);
  const std::size_t octave = (bucket - kExact) / kAnOctave + 1;
  const std::size_t value = (bucket - kExact) % kAnOctave + kAnOctave;
  return static_cast<std::int64_t>(((static_cast<u64>(value) + 1) << octave) - 1);
}

void LatencyHistogram::add(std::int64_t ns) {
  raise(counts_[bucket_of(ns)], u64{1});
  raise(count_, u64{1});
  if (ns > max()) max_.store(ns, kRelaxed);
}

void LatencyHistogram::merge(const LatencyHistogram& other) {
  for (std::size_t i = 0; i < counts_.size(); ++i) raise(counts_[i], other.counts_[i].load(kRelaxed));
  raise(count_, other.count());
  if (other.max() > max()) max_.store(other.max(), kRelaxed);
}

LatencyHistogram& LatencyHistogram::operator=(const LatencyHistogram& other) {
  if (this == &other) return *this;
  for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i].store(other.counts_[i].load(kRelaxed), kRelaxed);
  count_.store(other.count(), kRelaxed);
  max_.store(other.max(), kRelaxed);
  return *this;
}

std::int64_t LatencyHistogram::quantile(double share) const {
  // Of what the buckets hold, not of count_, which may be a frame ahead of them.
  u64 all = 0;
  for (const std::atomic<u64>& count : counts_) all += count.load(kRelaxed);
  const u64 rank = std::max<u64>(1, static_cast<u64>(std::ceil(share * static_cast<double>(all))));
  u64 below = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    below += counts_[i].load(kRelaxed);
    if (below >= rank) return i + 1 == counts_.size() ? max() : std::min(upper_end(i), max());
  }
  return max();
}

}  // namespace berth
