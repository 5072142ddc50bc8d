// Scenarios: what the simulator's TOML files give, and what is said about wrong ones.
#include "sim/scenario.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "berth/error.hpp"
#include "sim/geometry.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

const std::string kScenarios = std::string(BERTH_SOURCE_DIR) + "/scenarios/";

std::string written(const std::string& text) {
  static const test::ScratchFolder folder;
  return folder.write("scenario.toml", text);
}

std::string error_of(const std::string& path) {
  try {
    open_scenario(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Scenario, AllThatShipOpenAndRender) {
  for (const char* name : {"approach", "rectangle", "axis-x", "axis-y", "axis-z", "axis-rx", "axis-ry", "axis-rz"}) {
    SCOPED_TRACE(name);
    const auto source = open_scenario(kScenarios + name + ".toml");
    ASSERT_TRUE(source->size().has_value());
    EXPECT_GE(*source->size(), 80u);
    ASSERT_TRUE(source->camera().has_value());
    if (std::string(name).compare(0, 5, "axis-") == 0 && std::string(name) != "axis-rz") continue;  // alike, and slow
    const auto frame = source->next();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->image.width(), 640);
    EXPECT_EQ(frame->image.height(), 480);
    EXPECT_EQ(frame->label, std::string(name) + ".toml#0");
    ASSERT_FALSE(frame->truth.empty());
    EXPECT_EQ(frame->truth[0].visible, 1);
  }
}

const char* const kSmall = R"(
seed = 3
[camera]
width = 160
height = 120
frame_rate_hz = 50
exposure_ms = 0.02
readout_ms = 1
[background]
items = 5
[[marker]]
id = 9
position_m = [0.01, 0, 0]
[trajectory]
)";

TEST(Scenario, FramesCarryTimeAndTruth) {
  const auto source = open_scenario(written(std::string(kSmall) + "frames = 3\nfrom_range_m = 1\nto_range_m = 0.5\n"));
  EXPECT_EQ(source->size(), 3u);
  const double ranges[] = {1, 0.75, 0.5};
  for (int i = 0; i < 3; ++i) {
    const auto frame = source->next();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->stamp.sequence, static_cast<u64>(i));
    EXPECT_EQ(frame->stamp.exposure_start_ns, 20000000 * i);
    EXPECT_EQ(frame->stamp.mid_exposure_ns, 20000000 * i + 10000);
    EXPECT_EQ(frame->stamp.arrival_ns, 20000000 * i + 1020000);
    EXPECT_STREQ(frame->stamp.clock, "simulation");
    ASSERT_EQ(frame->truth.size(), 1u);
    EXPECT_EQ(frame->truth[0].family, "tag36h11");
    EXPECT_EQ(frame->truth[0].id, 9);
    EXPECT_NEAR(frame->truth[0].pose.t[0], 0.01, 1e-12);
    EXPECT_NEAR(frame->truth[0].pose.t[2], ranges[i], 1e-12);
  }
  EXPECT_FALSE(source->next().has_value());
}

TEST(Scenario, TheSameSeedGivesTheSameFramesAndAnotherDoesNot) {
  const std::string tail = "frames = 2\n";
  const auto bytes = [](Source& source) {
    std::vector<u8> all;
    while (const auto frame = source.next()) {
      const View2D<const u8> view = frame->image.view();
      all.insert(all.end(), view.data, view.data + view.width * view.height);
    }
    return all;
  };
  const std::string path = written(kSmall + tail);
  const std::vector<u8> once = bytes(*open_scenario(path)), again = bytes(*open_scenario(path));
  EXPECT_EQ(once, again);
  std::string other = kSmall + tail;
  other.replace(other.find("seed = 3"), 8, "seed = 4");
  EXPECT_NE(once, bytes(*open_scenario(written(other))));
}

// In finer points than pixels, and about the markers alone, where it tells.
TEST(Scenario, ABlurInFinerPointsRoundsTheMarkersEdges) {
  const std::string sensor = "frames = 1\n[sensor]\nread_noise = 0\nfull_well_e = 1e7\nblur_fineness = ";
  const GrayImage plain = open_scenario(written(kSmall + sensor + "1\n"))->next()->image;
  const GrayImage fine = open_scenario(written(kSmall + sensor + "4\n"))->next()->image;
  int changed = 0, most = 0;
  for (int y = 0; y < plain.height(); ++y) {
    for (int x = 0; x < plain.width(); ++x) {
      const int by = std::abs(plain.view().at(x, y) - fine.view().at(x, y));
      changed += by > 0 ? 1 : 0;
      most = std::max(most, by);
    }
  }
  EXPECT_GT(changed, 20);
  EXPECT_LT(changed, plain.width() * plain.height() / 4);
  EXPECT_GT(most, 1);
  EXPECT_LT(most, 30);
}

TEST(Scenario, RectangleGoesOnceAroundInOnePlane) {
  const auto source = open_scenario(
      written(std::string(kSmall) + "kind = \"rectangle\"\nframes = 5\nwidth_m = 0.4\nheight_m = 0.4\nrange_m = 1\n"));
  const double x[] = {-0.2, 0.2, 0.2, -0.2, -0.2}, y[] = {-0.2, -0.2, 0.2, 0.2, -0.2};
  for (int i = 0; i < 5; ++i) {
    const auto frame = source->next();
    EXPECT_NEAR(frame->truth[0].pose.t[0], x[i] + 0.01, 1e-9);
    EXPECT_NEAR(frame->truth[0].pose.t[1], y[i], 1e-9);
    EXPECT_NEAR(frame->truth[0].pose.t[2], 1, 1e-12);
  }
}

TEST(Scenario, AnAxisTurnsByItsDegreesAlone) {
  const auto source =
      open_scenario(written(std::string(kSmall) + "kind = \"axis\"\naxis = \"ry\"\nframes = 3\nfrom = -30\nto = 30\n"));
  for (const double expected_deg : {-30.0, 0.0, 30.0}) {
    const auto frame = source->next();
    const auto& R = frame->truth[0].pose.R;
    EXPECT_NEAR(R[2], std::sin(expected_deg * sim::kPi / 180), 1e-12);
    EXPECT_NEAR(R[4], 1, 1e-12);
  }
}

struct Wrong {
  const char* text;
  std::vector<std::string> told;
};

TEST(Scenario, ErrorsNameFileLineFieldValueAndRemedy) {
  const Wrong cases[] = {
      {"[camera]\nwidth = 0\n", {".toml:2:", "'camera.width'", "is 0", "from 16 to 16384"}},
      {"[camera]\nheight = 400\n", {".toml:2:", "'camera.height'", "is 400", "4:3"}},
      {"[camera]\nfx = 600.0\n", {"'camera.fy'", "missing", "all of fx, fy, cx, cy"}},
      {"[camera]\ndistortion = [0, 0]\n", {"'camera.distortion'", "[0, 0]", "5 numbers"}},
      {"[camera]\nexposure_ms = 40\n", {"'camera.exposure_ms'", "is 40", "frame_rate_hz"}},
      {"[camera]\nfile = \"none.yaml\"\n", {"none.yaml"}},
      {"[camera]\nfocal = 3\n", {".toml:2:", "'camera.focal'", "unknown", "frame_rate_hz"}},
      {"sede = 3\n", {".toml:1:", "'sede'", "unknown", "seed"}},
      {"seed = \"x\"\n", {"'seed'", "\"x\"", "whole number"}},
      {"[sensor]\ngamma = 0\n", {"'sensor.gamma'", "is 0", "from 0.1 to 5"}},
      {"[sensor]\nblur_fineness = 9\n", {"'sensor.blur_fineness'", "is 9", "from 1 to 8"}},
      {"[sensor]\nread_noise = nan\n", {"'sensor.read_noise'", "nan", "from 0 to 60"}},
      {"[sensor]\nwhite_level = 5\nblack_level = 9\n", {"'sensor.white_level'", "is 5", "above black_level"}},
      {"[[marker]]\nfamily = \"tag36h12\"\n", {".toml:2:", "'marker[0].family'", "\"tag36h12\"", "tag36h11"}},
      {"[[marker]]\n[[marker]]\nid = 587\n", {".toml:3:", "'marker[1].id'", "is 587", "from 0 to 586"}},
      {"[[marker]]\nsize_m = 0\n", {"'marker[0].size_m'", "is 0", "from 0.0005 to 10"}},
      {"marker = 3\n", {"'marker'", "is 3", "[[marker]]"}},
      {"camera = 3\n", {"'camera'", "is 3", "[camera]"}},
      {"[lighting]\ndirection = [0, 0, 0]\n", {"'lighting.direction'", "[0, 0, 0]", "not zero"}},
      {"[target]\nwings = 1\n", {"'target.wings'", "is 1", "true or false"}},
      {"[trajectory]\nkind = \"spiral\"\n", {"'trajectory.kind'", "\"spiral\"", "\"rectangle\""}},
      {"[trajectory]\nkind = \"axis\"\n", {"'trajectory.axis'", "missing", "\"rz\""}},
      {"[trajectory]\nkind = \"axis\"\naxis = \"z\"\nfrom = -2\n", {"'trajectory.from'", "is -2", "0.05"}},
      {"[trajectory]\nframes = 0\n", {"'trajectory.frames'", "is 0", "from 1 to"}},
      {"[trajectory]\nrange_m = 1\n", {"'trajectory.range_m'", "unknown"}},
      {"[trajectory]\nkind = \"views\"\ntilt_deg = [10, 90]\n", {"'trajectory.tilt_deg'", "[10, 90]", "from 0 to 80"}},
      {"[board]\nkind = \"circles\"\n", {".toml:2:", "'board.kind'", "\"circles\"", "\"charuco\""}},
      {"[board]\nfamily = \"tag36h12\"\n", {"'board.family'", "\"tag36h12\"", "tag36h11"}},
      {"[board]\nkind = \"chessboard\"\ncolumns = 3\n", {"'board.kind'", "3 x 6 squares", "give 4 to 100"}},
      {"[board]\nkind = \"charuco\"\npitch_m = 0.03\n", {"'board.kind'", "too little white"}},
      {"[camera\n", {".toml:1:", "not TOML"}},
      {"", {".toml", "empty"}},
  };
  for (const Wrong& wrong : cases) {
    const std::string error = error_of(written(wrong.text));
    for (const std::string& part : wrong.told) EXPECT_NE(error.find(part), std::string::npos) << part << "\n" << error;
  }
  const std::string missing = testing::TempDir() + "no_such_scenario.toml";
  EXPECT_NE(error_of(missing).find(missing), std::string::npos);
  EXPECT_NE(error_of(testing::TempDir()).find("not a file"), std::string::npos);
}

}  // namespace
}  // namespace berth
