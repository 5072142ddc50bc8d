// Histograms against sorted lists of the same times.
#include "berth/latency.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

namespace berth {
namespace {

/// From a few ns to minutes, evenly in the logarithm.
std::vector<std::int64_t> mixed_times(unsigned seed, int count) {
  std::mt19937 random(seed);
  std::vector<std::int64_t> times;
  for (int i = 0; i < count; ++i) {
    times.push_back(static_cast<std::int64_t>(std::exp2(2 + 36 * (static_cast<double>(random()) / 4294967296.0))));
  }
  return times;
}

LatencyHistogram histogram_of(const std::vector<std::int64_t>& times) {
  LatencyHistogram histogram;
  for (const std::int64_t ns : times) histogram.add(ns);
  return histogram;
}

TEST(LatencyHistogram, BucketsCoverEveryTimeOnceInOrder) {
  EXPECT_EQ(LatencyHistogram::bucket_of(-5), 0u);
  std::int64_t first = 0;
  for (std::size_t bucket = 0; first < (std::int64_t{1} << 39); ++bucket) {
    const std::int64_t last = LatencyHistogram::upper_end(bucket);
    ASSERT_GE(last, first);
    ASSERT_EQ(LatencyHistogram::bucket_of(first), bucket);
    ASSERT_EQ(LatencyHistogram::bucket_of(last), bucket);
    ASSERT_LE(last - first, first / 128) << "no bucket is wider than 0.8 %";
    first = last + 1;
  }
}

TEST(LatencyHistogram, QuantilesAreThoseOfTheSortedTimes) {
  std::vector<std::int64_t> times = mixed_times(7, 5000);
  const LatencyHistogram histogram = histogram_of(times);
  std::sort(times.begin(), times.end());
  EXPECT_EQ(histogram.count(), times.size());
  EXPECT_EQ(histogram.max(), times.back());
  for (const double share : {0.0, 0.001, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const std::size_t rank = std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(share * 5000)));
    const std::int64_t exact = times[rank - 1];
    EXPECT_GE(histogram.quantile(share), exact) << share;
    EXPECT_LE(histogram.quantile(share), exact + exact / 128) << share;
  }
}

TEST(LatencyHistogram, KeepsTheExtremes) {
  LatencyHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), 0);
  EXPECT_EQ(histogram.max(), 0);
  histogram.add(std::int64_t{1} << 60);
  EXPECT_EQ(histogram.quantile(0.5), std::int64_t{1} << 60);
  histogram.add(3);
  EXPECT_EQ(histogram.quantile(0.5), 3);
  histogram.clear();
  EXPECT_EQ(histogram.count(), 0u);
  EXPECT_EQ(histogram.max(), 0);
}

TEST(LatencyHistogram, MergedIsAsIfAddedToOne) {
  const std::vector<std::int64_t> one = mixed_times(1, 700);
  const std::vector<std::int64_t> two = mixed_times(2, 900);
  std::vector<std::int64_t> both = one;
  both.insert(both.end(), two.begin(), two.end());
  LatencyHistogram merged = histogram_of(one);
  merged.merge(histogram_of(two));
  const LatencyHistogram whole = histogram_of(both);
  EXPECT_EQ(merged.count(), whole.count());
  EXPECT_EQ(merged.max(), whole.max());
  for (int percent = 0; percent <= 100; ++percent) {
    EXPECT_EQ(merged.quantile(percent / 100.0), whole.quantile(percent / 100.0)) << percent;
  }
}

TEST(LatencyHistogram, MayBeReadWhileOneThreadAdds) {
  LatencyHistogram histogram;
  std::thread adding([&] {
    for (int i = 1; i <= 20000; ++i) histogram.add(1000);
  });
  u64 before = 0;
  while (before < 20000) {
    const LatencyHistogram copy = histogram;
    EXPECT_GE(copy.count(), before);
    if (copy.count() > 0) {
      EXPECT_GE(copy.max(), 0);
      EXPECT_LE(copy.quantile(0.99), 1007);
    }
    before = copy.count();
  }
  adding.join();
}

}  // namespace
}  // namespace berth
