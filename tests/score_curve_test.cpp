// The points of ROC and precision-recall curves, the areas under them, and their drawings.
#include "score_curve.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "roc_svg.hpp"

namespace berth::cli {
namespace {

using testing::HasSubstr;

/// threshold, right found, false found of each point.
std::vector<std::array<int, 3>> points_of(const std::vector<CurvePoint>& curve) {
  std::vector<std::array<int, 3>> points;
  for (const CurvePoint& p : curve) {
    points.push_back({p.threshold_q15, p.decisions.right_found, p.decisions.false_found});
  }
  return points;
}

using Points = std::vector<std::array<int, 3>>;

TEST(ScoreCurve, HasAPointAScore) {
  const std::vector<CurvePoint> curve = score_curve({{100, false}, {900, true}, {500, true}, {700, false}});
  EXPECT_EQ(points_of(curve), (Points{{32769, 0, 0}, {900, 1, 0}, {700, 1, 1}, {500, 2, 1}, {100, 2, 2}}));
  EXPECT_EQ(curve[1].decisions.missed, 1);
  EXPECT_EQ(curve[1].decisions.right_absent, 2);
  // Three of the four pairs are in order.
  EXPECT_EQ(roc_area(curve), 0.75);
  // Half the recall at precision 1, half at 2 of 3.
  EXPECT_DOUBLE_EQ(average_precision(curve).value_or(-1), 0.5 * 1 + 0.5 * 2 / 3);
}

TEST(ScoreCurve, FindsEqualScoresTogether) {
  std::vector<Scored> images = {{32768, true}, {32768, false}, {0, true}, {0, false}, {0, false}, {16384, true}};
  const Points expected = {{32769, 0, 0}, {32768, 1, 1}, {16384, 2, 1}, {0, 3, 3}};
  std::sort(images.begin(), images.end(), [](const Scored& a, const Scored& b) {
    return a.score_q15 != b.score_q15 ? a.score_q15 < b.score_q15 : a.present < b.present;
  });
  EXPECT_EQ(points_of(score_curve(images)), expected);
  std::reverse(images.begin(), images.end());
  const std::vector<CurvePoint> curve = score_curve(images);
  EXPECT_EQ(points_of(curve), expected);
  // Pairs in order: 2 of the first target's, 2 of the middle one's; equal: 1 and the last one's 2, half each.
  EXPECT_DOUBLE_EQ(roc_area(curve).value_or(-1), (2 + 2 + 0.5 * 3) / 9);
  EXPECT_DOUBLE_EQ(average_precision(curve).value_or(-1), (1.0 / 2 + 2.0 / 3 + 3.0 / 6) / 3);
}

TEST(ScoreCurve, AScoreForAllIsADiagonal) {
  const std::vector<CurvePoint> curve = score_curve({{7, true}, {7, false}, {7, false}, {7, false}});
  EXPECT_EQ(points_of(curve), (Points{{32769, 0, 0}, {7, 1, 3}}));
  EXPECT_EQ(roc_area(curve), 0.5);
  EXPECT_EQ(average_precision(curve), 0.25);
}

TEST(ScoreCurve, PerfectAndReversed) {
  EXPECT_EQ(roc_area(score_curve({{9, true}, {8, true}, {7, false}})), 1);
  EXPECT_EQ(average_precision(score_curve({{9, true}, {8, true}, {7, false}})), 1);
  EXPECT_EQ(roc_area(score_curve({{1, true}, {2, true}, {7, false}})), 0);
}

TEST(ScoreCurve, HasNoAreaWhereAKindIsMissing) {
  const std::vector<CurvePoint> present = score_curve({{3, true}, {5, true}});
  EXPECT_EQ(points_of(present), (Points{{32769, 0, 0}, {5, 1, 0}, {3, 2, 0}}));
  EXPECT_EQ(roc_area(present), std::nullopt);
  EXPECT_EQ(average_precision(present), 1);
  const std::vector<CurvePoint> absent = score_curve({{3, false}, {5, false}});
  EXPECT_EQ(roc_area(absent), std::nullopt);
  EXPECT_EQ(average_precision(absent), std::nullopt);
  const std::vector<CurvePoint> none = score_curve({});
  EXPECT_EQ(points_of(none), (Points{{32769, 0, 0}}));
  EXPECT_EQ(roc_area(none), std::nullopt);
  EXPECT_EQ(average_precision(none), std::nullopt);
}

RocPlot small_plot() {
  RocPlot plot;
  plot.network = "a<b";
  plot.curve = score_curve({{100, false}, {900, true}, {500, true}, {700, false}});
  plot.threshold_q15 = 600;
  plot.others = {{"ORB", {{"0.45", {}}, {"0.80", {2, 0, 1, 1}}}}};
  plot.others[0].marks[0].decisions = {0, 2, 0, 2};
  return plot;
}

TEST(RocSvg, DrawsCurveThresholdAndOthers) {
  const std::string svg = roc_svg(small_plot());
  EXPECT_THAT(svg, HasSubstr("2 images with the target, 2 without; large dot: threshold 0.02"));
  EXPECT_THAT(svg, HasSubstr("a&lt;b, area under the curve 0.75000"));
  // The panel is 480 px from (72, 76): up to a half, right to a half, up, right.
  EXPECT_THAT(svg, HasSubstr("M72.00 556.00L72.00 316.00L312.00 316.00L312.00 76.00L552.00 76.00"));
  EXPECT_THAT(svg, HasSubstr("cx='312.00' cy='316.00' r='5'"));
  EXPECT_THAT(svg, HasSubstr("M72.00 556.00L312.00 76.00"));
  EXPECT_THAT(svg, HasSubstr(">0.45</text>"));
  EXPECT_THAT(svg, HasSubstr(">ORB</text>"));
}

TEST(RocSvg, PrecisionHasNoPlaceWhereNothingIsFound) {
  const std::string svg = precision_recall_svg(small_plot());
  EXPECT_THAT(svg, HasSubstr("a&lt;b, area under the curve 0.83333"));
  EXPECT_THAT(svg, HasSubstr("M72.00 76.00L312.00 76.00L312.00 236.00L552.00 236.00"));
  EXPECT_THAT(svg, HasSubstr("cx='312.00' cy='316.00' r='5'"));
  EXPECT_EQ(svg.find(">0.45</text>"), std::string::npos);
  EXPECT_THAT(svg, HasSubstr(">0.80</text>"));
}

TEST(RocSvg, SaysThatAnAreaIsUndefined) {
  RocPlot plot;
  plot.network = "net";
  plot.curve = score_curve({{3, false}});
  for (const std::string& svg : {roc_svg(plot), precision_recall_svg(plot)}) {
    EXPECT_THAT(svg, HasSubstr("net, area under the curve undefined"));
    EXPECT_EQ(svg.find("nan"), std::string::npos);
  }
}

}  // namespace
}  // namespace berth::cli
