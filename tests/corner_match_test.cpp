// Which quadrilaterals are the same, looked up by where they begin or each with each.
#include "frame/corner_match.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "sim/random.hpp"

namespace berth {
namespace {

Corners square(double x, double y, double side) {
  return {{{x, y}, {x + side, y}, {x + side, y + side}, {x, y + side}}};
}

TEST(CornerIndex, FindsWhatComparingEachFinds) {
  constexpr int kWidth = 61, kHeight = 45;  // no multiples of a cell
  constexpr double kTolerance_px = 0.25;
  sim::Random random(3);
  CornerIndex index(kWidth, kHeight, 2000);
  int found = 0;
  for (int round = 0; round < 2; ++round) {
    index.clear();
    std::vector<Corners> all;
    for (int i = 0; i < 2000; ++i) {
      // Some begin outside the image, and many at the edge of a cell, to either side of it.
      Corners corners = square(random.uniform(-4, kWidth + 4), random.uniform(-4, kHeight + 4), random.uniform(4, 6));
      if (i % 2 == 0) corners = square(8 * (i % 7) + random.uniform(-0.2, 0.2), 8 * (i % 5), 5);
      bool is_same = false;
      for (const Corners& other : all) is_same = is_same || same_corners(corners, other, kTolerance_px);
      ASSERT_EQ(index.has(corners, kTolerance_px), is_same) << i;
      found += is_same ? 1 : 0;
      if (is_same && i % 3 != 0) continue;
      index.add(corners);
      all.push_back(corners);
    }
  }
  EXPECT_GT(found, 500);
}

TEST(CornerIndex, TakesCornersThatAreNoNumbers) {
  CornerIndex index(640, 480, 10);
  Corners corners = square(0, 0, 5);
  corners[0][0] = corners[1][0] = corners[2][0] = corners[3][0] = std::numeric_limits<double>::quiet_NaN();
  index.add(corners);
  EXPECT_FALSE(index.has(corners, 0.25));
}

TEST(SameCorners, NeedsAllOfBoth) {
  EXPECT_TRUE(same_corners(square(10, 10, 20), square(10.1, 9.9, 20), 0.25));
  Corners turned = square(10, 10, 20);
  std::swap(turned[0], turned[2]);
  EXPECT_TRUE(same_corners(square(10, 10, 20), turned, 0.25));
  EXPECT_FALSE(same_corners(square(10, 10, 20), square(10, 10, 20.3), 0.25));
  EXPECT_FALSE(same_corners(square(10, 10, 0.1), square(10, 10, 20), 0.25)) << "a small one at a corner of a large one";
}

}  // namespace
}  // namespace berth
