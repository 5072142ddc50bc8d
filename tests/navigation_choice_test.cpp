// Where the network runs: measured once, and the same from the record ever after.
#include "navigation_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "berth/error.hpp"
#include "support/command_run.hpp"
#include "support/pictures.hpp"

namespace berth::cli {
namespace {

using testing::HasSubstr;

class Choice : public testing::Test {
 protected:
  Choice() {
    navigator_.network = std::string(BERTH_SOURCE_DIR) + "/training/tests/data/tiny.berthnet";
    engine_.backend = "simd";
  }
  NavigationChoice choose(const NavigationOptions& options, double fps = 60) {
    return choose_navigation(options, engine_, "simd", navigator_, image_.view(), fps);
  }
  std::string refusal(const NavigationOptions& options) {
    try {
      choose(options);
    } catch (const Error& error) {
      return error.what();
    }
    return "chosen";
  }
  const test::ScratchFolder folder_;
  const GrayImage image_ = pictures::uniform(96, 80, 90);
  NavigatorConfig navigator_;
  EngineOptions engine_;
};

TEST_F(Choice, IsTheDockingsBackendUnlessSaid) {
  const NavigationChoice measured = choose({});
  EXPECT_EQ(measured.backend, "simd");
  EXPECT_TRUE(measured.is_measured);
  EXPECT_EQ(measured.frames, std::max(1, static_cast<int>(std::ceil(measured.look_ms.at("simd") * 60 / 500))));
  const NavigationChoice said = choose({"cpu", 7, ""});
  EXPECT_EQ(said.backend, "cpu");
  EXPECT_EQ(said.frames, 7);
  EXPECT_FALSE(said.is_measured);
  EXPECT_TRUE(said.look_ms.empty());
}

TEST_F(Choice, IsMeasuredOnceAndThenOnRecord) {
  const std::string path = folder_ / "record.json";
  const NavigationChoice first = choose({"", 0, path});
  EXPECT_TRUE(first.is_measured);
  EXPECT_EQ(first.look_ms.count("simd"), 1u);
  EXPECT_EQ(first.look_ms.count("cpu"), 0u);
  for (const auto& [name, ms] : first.look_ms) EXPECT_LE(first.look_ms.at(first.backend), ms) << name;
  const NavigationChoice again = choose({"", 0, path});
  EXPECT_FALSE(again.is_measured);
  EXPECT_EQ(again.backend, first.backend);
  EXPECT_EQ(again.look_ms, first.look_ms);
  EXPECT_EQ(again.frames, first.frames);
}

TEST_F(Choice, GoesByTheRecordAtEveryRate) {
  const std::string path = folder_.write(
      "record.json",
      std::string(
          R"({"backend": "cpu", "network": "tiny.berthnet", "size": "96x80", "slowest_look_ms": {"cpu": 40, "simd": 90}})"));
  EXPECT_EQ(choose({"", 0, path}, 100).backend, "cpu");
  EXPECT_EQ(choose({"", 0, path}, 100).frames, 8) << "80 ms";
  EXPECT_EQ(choose({"", 0, path}, 10).frames, 1);
  EXPECT_EQ(choose({"", 3, path}, 100).frames, 3);
}

TEST_F(Choice, RefusesWhatDoesNotFit) {
  const auto refused = [&](const std::string& text) {
    const std::string path = folder_.write("record.json", text);
    return refusal({"", 0, path});
  };
  EXPECT_THAT(refused("nothing"), HasSubstr("field 'backend' is missing; delete the file"));
  EXPECT_THAT(refused(R"({"backend": "simd", "network": "lite.berthnet"})"), HasSubstr("this is tiny.berthnet"));
  EXPECT_THAT(refused(R"({"backend": "simd", "network": "tiny.berthnet", "size": "640x480"})"),
              HasSubstr("this is 96x80"));
  EXPECT_THAT(refused(R"({"backend": "simd", "network": "tiny.berthnet", "size": "96x80"})"),
              HasSubstr("no time above 0 for simd"));
  EXPECT_THAT(refusal({"", -1, ""}), HasSubstr("--nav-frames"));
  EXPECT_THAT(refusal({"fpga", 0, ""}), HasSubstr("fpga"));
}

}  // namespace
}  // namespace berth::cli
