// Files and layouts of targets of discs: what is read, what is refused and why; and the ellipses that discs become.
#include "berth/disc_target.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "berth/error.hpp"
#include "support/disc_scene.hpp"
#include "support/scratch_folder.hpp"
#include "target/disc_choice.hpp"
#include "target/disc_pose.hpp"

namespace berth {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string kRoot = BERTH_SOURCE_DIR;

std::string complaint(const std::string& text) {
  const test::ScratchFolder folder;
  const std::string path = folder.write("t.yaml", text);
  try {
    read_disc_target(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// A target file of these discs and bars.
std::string file(const std::string& discs, const std::string& bars = "") {
  std::string text = "disc_target:\n  name: t\n  discs: [" + discs + "]\n";
  if (!bars.empty()) text += "  bars: [" + bars + "]\n";
  return text;
}

constexpr const char* kThree =
    "{x: -0.05, y: 0.05, diameter: 0.03}, {x: 0.05, y: 0.05, diameter: 0.03}, {x: 0.05, y: -0.05, diameter: 0.03}, ";
constexpr const char* kRing = "{x: -0.05, y: -0.05, diameter: 0.03, hole: 0.015}";
constexpr const char* kDisc = "{x: -0.05, y: -0.05, diameter: 0.03}";

TEST(DiscTargetFile, ThoseThatComeWithBerthAreRead) {
  const DiscTarget port = read_disc_target(kRoot + "/targets/port.yaml");
  EXPECT_EQ(port.name, "port");
  ASSERT_EQ(port.discs.size(), 5u);
  EXPECT_EQ(port.discs[0].hole_m, 0.015);
  EXPECT_EQ(port.discs[1].hole_m, 0);
  EXPECT_EQ(port.discs[1].y_m, 0.05);
  const DiscTarget cross = read_disc_target(kRoot + "/targets/cross.yaml");
  EXPECT_EQ(cross.discs.size(), 4u);
  ASSERT_EQ(cross.bars.size(), 2u);
  EXPECT_EQ(cross.bars[1].to_m[1], 0.055);
  EXPECT_EQ(complaint(file(std::string(kThree) + kRing)), "");
}

TEST(DiscTargetFile, SaysWhatIsWrongWhereAndWhatToDo) {
  const auto four = [](const std::string& last) { return file(kThree + last); };
  EXPECT_THAT(complaint("a: [1"),
              AllOf(HasSubstr("t.yaml: not a YAML file (line "), HasSubstr("docs/disc-targets.md")));
  EXPECT_THAT(complaint("a: 1"), HasSubstr("t.yaml: disc_target: missing; see docs/disc-targets.md"));
  EXPECT_THAT(complaint(four("{x: 0, y: 0}")), HasSubstr("disc_target.discs[3].diameter: missing; give metres"));
  EXPECT_THAT(complaint(four("{x: wide, y: 0, diameter: 1}")),
              HasSubstr("disc_target.discs[3].x: \"wide\" is not a finite number; give a decimal number"));
  EXPECT_THAT(complaint(four("{x: 50000, y: 0, diameter: 1}")), HasSubstr("50000 m is out of bounds; give metres"));
  EXPECT_THAT(complaint(four("{x: 0, y: 0, radius: 0.01}")),
              HasSubstr("disc_target.discs[3]: unknown key \"radius\"; use x, y, diameter, hole"));
  EXPECT_THAT(complaint(four("{x: -0.05, y: -0.05, diameter: 0.03, hole: 0.025}")),
              HasSubstr("disc 3 has a hole of 0.025 m in a diameter of 0.03 m; give 0.35 to 0.6 of the diameter"));
  EXPECT_THAT(complaint(four("{x: -0.05, y: -0.05, diameter: -1}")), HasSubstr("disc 3 has the diameter -1 m; give"));
  EXPECT_THAT(complaint(four("{x: 0.03, y: 0.05, diameter: 0.03, hole: 0.015}")),
              HasSubstr("discs 1 and 3 have -0.01 m between them; leave a quarter"));
  EXPECT_THAT(complaint(file(kThree)), HasSubstr("target \"t\" has 3 discs; give 4 to 16"));
  EXPECT_THAT(complaint(file(std::string(kThree) + kRing, "{from: [0, 0], to: [0.05], width: 0.004}")),
              HasSubstr("disc_target.bars[0].to: not two numbers; give [x, y] in metres"));
  EXPECT_THAT(complaint(file(std::string(kThree) + kRing, "{from: [0, 0], to: [0.04, 0.04], width: 0.004}")),
              HasSubstr("a bar comes within"));
  EXPECT_THAT(complaint(file("{x: 0, y: 0, diameter: 0.01}, {x: 0.1, y: 0, diameter: 0.01}, "
                             "{x: 0.2, y: 0.005, diameter: 0.01}, {x: 0.4, y: 0, diameter: 0.01}")),
              HasSubstr("nearly on one line"));
  EXPECT_THROW(read_disc_target("/nowhere/t.yaml"), Error);
}

TEST(DiscTargetFile, RefusesWhatLooksTheSameWhenItIsTurned) {
  EXPECT_THAT(complaint(file(std::string(kThree) + kDisc)),
              AllOf(HasSubstr("looks the same when it is turned"), HasSubstr("make one disc a ring")));
  const std::string both = "{from: [-0.03, 0], to: [0.03, 0], width: 0.006}";
  EXPECT_THAT(complaint(file(std::string(kThree) + kDisc, both)), HasSubstr("looks the same"));  // by half a turn
  EXPECT_EQ(complaint(file(std::string(kThree) + kDisc, both + ", {from: [0, 0], to: [0, 0.03], width: 0.006}")), "");
  // A disc out of place tells too, and so does a larger one.
  EXPECT_EQ(complaint(file(std::string(kThree) + "{x: -0.02, y: -0.05, diameter: 0.03}")), "");
  EXPECT_EQ(complaint(file(std::string(kThree) + "{x: -0.05, y: -0.05, diameter: 0.045}")), "");
}

TEST(DiscEllipse, IsTheOutlineAsThePoseShowsIt) {
  sim::Random random(3);
  const CameraModel camera = paper_camera();
  const DiscTarget port = read_disc_target(kRoot + "/targets/port.yaml");
  for (int i = 0; i < 20; ++i) {
    const Pose pose = test::random_target_pose(camera, port, 60, 60, random);
    for (const TargetDisc& disc : port.discs) {
      Ellipse ellipse;
      ASSERT_TRUE(disc_ellipse(pose, disc, ellipse));
      const Vec2 center = test::ellipse_center(pose, disc);
      EXPECT_NEAR(ellipse.center[0], center[0], 1e-7);
      EXPECT_NEAR(ellipse.center[1], center[1], 1e-7);
      for (int k = 0; k < 7; ++k) {
        const double r = disc.diameter_m / 2;
        const Vec3 at = transform(pose, {disc.x_m + r * exact_cos(k), disc.y_m + r * exact_sin(k), 0});
        const double x = at[0] / at[2] - ellipse.center[0], y = at[1] / at[2] - ellipse.center[1];
        const auto& m = ellipse.matrix;
        EXPECT_NEAR((m[2] * x * x - 2 * m[1] * x * y + m[0] * y * y) / ellipse.determinant(), 1, 1e-9);
      }
    }
  }
}

DiscAssignment assignment(std::initializer_list<int> discs) {
  DiscAssignment result;
  result.fill(kNoDisc);
  std::copy(discs.begin(), discs.end(), result.begin());
  return result;
}

TEST(DiscChoice, IsDoubtfulInWhateverOrderTheWaysCome) {
  struct Way {
    DiscAssignment assignment;
    int used;
    double chi_square;
  };
  // The first and the last go together (a disc more or less); the second is the target turned by a quarter.
  std::vector<Way> ways = {{assignment({0, 1, 2, kNoDisc, 4}), 4, 9},
                           {assignment({1, 2, 0, kNoDisc, 4}), 4, 20},
                           {assignment({0, 1, 2, 3, kNoDisc}), 4, 7}};
  const auto doubtful = [&](const std::vector<std::size_t>& order) {
    DiscChoice choice;
    for (const std::size_t i : order) choice.offer(ways[i].assignment, ways[i].used, ways[i].chi_square);
    return choice.is_doubtful();
  };
  const auto in_any_order = [&](bool expected) {
    for (const auto& order :
         std::vector<std::vector<std::size_t>>{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}) {
      EXPECT_EQ(doubtful(order), expected);
    }
  };
  in_any_order(true);
  ways[1].chi_square = 60;  // fits much worse
  in_any_order(false);
  ways[1] = {assignment({1, 2, 0, kNoDisc, kNoDisc}), 3, 1};  // takes fewer discs
  in_any_order(false);
  EXPECT_TRUE(DiscChoice().empty());
}

}  // namespace
}  // namespace berth
