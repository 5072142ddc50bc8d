// What a recording holds of a frame and its camera, read back, and what is refused of it.
#include "camera/recorded_frame.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/complaint.hpp"

namespace berth {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string frame_text(const std::string& number, const std::string& missed) {
  return R"({"frame": )" + number + R"(, "exposure_start_ns": -5, "mid_exposure_ns": 7, "arrival_ns": 9, )" +
         R"("clock": "ros", "label": "one", "missed": )" + missed + "}";
}

TEST(RecordedFrame, ReadsItsNumbersWhole) {
  const RecordedFrame read = read_recorded_frame(frame_text("18446744073709551615", "2"), "a.mcap");
  EXPECT_EQ(read.frame.stamp.sequence, 18446744073709551615u);
  EXPECT_EQ(read.frame.stamp.exposure_start_ns, -5);
  EXPECT_EQ(read.frame.stamp.mid_exposure_ns, 7);
  EXPECT_EQ(read.missed, 2u);
}

// A number that its type cannot hold would be converted into anything.
TEST(RecordedFrame, RefusesNumbersThatCannotBe) {
  for (const char* number : {"-1", "0.5", "2.2e10", "18446744073709551616", "\"7\"", "null"}) {
    EXPECT_THAT(test::complaint([&] { read_recorded_frame(frame_text(number, "0"), "a.mcap"); }),
                AllOf(HasSubstr("a.mcap: a frame's record cannot be read ('frame' is "), HasSubstr("it is left out")))
        << number;
  }
}

TEST(RecordedFrame, RefusesACameraThatCannotBe) {
  CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 700;
  const std::string text = recorded_camera_text(camera);
  EXPECT_EQ(read_recorded_camera(text, "a.mcap").width, 640);
  const auto with_width = [&](const std::string& width) {
    std::string changed = text;
    const std::string known = "\"width\":640";
    changed.replace(changed.find(known), known.size(), "\"width\":" + width);
    return test::complaint([&] { read_recorded_camera(changed, "a.mcap"); });
  };
  EXPECT_THAT(with_width("2147483648"), AllOf(HasSubstr("'width' is 2147483648"), HasSubstr("give --camera")));
  EXPECT_THAT(with_width("2.22222e10"), HasSubstr("'width' is "));
  EXPECT_THAT(with_width("0"), HasSubstr("sides and focal lengths must be above 0"));
}

}  // namespace
}  // namespace berth
