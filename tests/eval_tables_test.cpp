// Tables of `berth eval` on a handful of judged images whose figures are known.
#include "eval_tables.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace berth::cli {
namespace {

using testing::HasSubstr;

s32 q16(double px) { return static_cast<s32>(px * 65536); }

Judged target(double depth_m, double visible, double d, int score_q15, const Square& said) {
  Judged judged;
  judged.truth.present = true;
  judged.truth.visible = visible;
  judged.truth.depth_m = depth_m;
  judged.truth.x = 100;
  judged.truth.y = 100;
  judged.truth.d = d;
  judged.output.score_q15 = score_q15;
  judged.output.x_q16 = q16(said.x);
  judged.output.y_q16 = q16(said.y);
  judged.output.d_q16 = q16(said.side);
  return judged;
}

Judged other(int score_q15) {
  Judged judged;
  judged.output.score_q15 = score_q15;
  return judged;
}

TEST(Overlap, OfSquares) {
  EXPECT_EQ(overlap({5, 5, 4}, {5, 5, 4}), 1);
  EXPECT_EQ(overlap({5, 5, 4}, {5, 5, 2}), 0.25);
  // 2 x 3 in common of 9 + 9 - 6.
  EXPECT_EQ(overlap({0, 0, 3}, {1, 0, 3}), 0.5);
  EXPECT_EQ(overlap({0, 0, 3}, {0, -1, 3}), 0.5);
  // 1 x 1 of 4 + 9 - 1, outside any image.
  EXPECT_DOUBLE_EQ(overlap({-100, -100, 2}, {-98.5, -98.5, 3}), 1.0 / 12);
  EXPECT_EQ(overlap({0, 0, 2}, {2, 0, 2}), 0);
  EXPECT_EQ(overlap({0, 0, 2}, {9, 9, 2}), 0);
  EXPECT_EQ(overlap({0, 0, 0}, {0, 0, 0}), 0);
}

TEST(RangeTable, CountsOverlapsAndErrorsByRange) {
  const std::string table = range_table(
      {
          target(2.5, 0.9, 80, 20000, {100, 100, 100}),  // overlap 0.64, range 20 % short
          target(2.5, 0.9, 80, 20000, {190, 100, 64}),   // beside it, range 25 % long
          target(2.5, 0.6, 80, 20000, {100, 100, 80}),   // right, but hidden: no range error
          target(2.5, 0.9, 80, 10000, {100, 100, 80}),   // not found
          target(5, 1, 30, 16384, {100, 110, 30}),       // 20 x 30 in common: exactly a half
          other(20000),
      },
      16384);
  EXPECT_THAT(table, HasSubstr("| to 3.0 m | 4 | 2 | 50.00 | 2 | 25.00 | 25.00 |\n"));
  EXPECT_THAT(table, HasSubstr("| to 6.0 m | 1 | 1 | 100.00 | 1 | 0.00 | 0.00 |\n"));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5);
}

TEST(RatesTable, SetsOthersBesideTheNetwork) {
  Rival rival{"ORB", {}};
  rival.decisions[0] = {1, 3, 0, 2};
  rival.decisions[7] = {4, 0, 1, 1};
  const std::string table =
      rates_table({target(2, 1, 80, 15000, {}), target(2, 1, 80, 27000, {}), other(14744), other(20000)}, {rival});
  // 0.45 is 14745 in Q15, 0.80 is 26214.
  EXPECT_THAT(table, HasSubstr("\n| 0.45 | 100.00 | 50.00 | 25.00 | 0.00 |\n"));
  EXPECT_THAT(table, HasSubstr("\n| 0.50 | 50.00 | 50.00 | 0.00 | 0.00 |\n"));
  EXPECT_THAT(table, HasSubstr("\n| 0.80 | 50.00 | 0.00 | 100.00 | 50.00 |\n"));
  EXPECT_THAT(table, HasSubstr("| ORB: true positives % | false positives % |\n"));
}

}  // namespace
}  // namespace berth::cli
