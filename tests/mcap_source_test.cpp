// Recordings as sources: the frames of Berth's own as they came, and the images of others'.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "camera/sources.hpp"
#include "recording/mcap_writer.hpp"
#include "recording/recover.hpp"
#include "ros2/messages.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/recorded_run.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using test::CommandRun;
using test::complaint;
using test::run_berth;
using test::ScratchFolder;
using test::small_scenario;
using test::text_of;
using testing::HasSubstr;

TEST(McapSource, FeedsARunWithTheFramesAsTheyCame) {
  const ScratchFolder folder;
  const std::string source = small_scenario(folder, 3), file = folder / "a.mcap";
  ASSERT_EQ(run_berth({"run", "--source", "sim:" + source, "--record", file}).exit_code, 0);
  const std::unique_ptr<Source> simulated = open_source("sim:" + source), recorded = open_source(file);
  EXPECT_EQ(recorded->camera()->fx, simulated->camera()->fx);
  EXPECT_EQ(recorded->camera()->distortion, simulated->camera()->distortion);
  for (int i = 0; i < 3; ++i) {
    const std::optional<SourceFrame> was = simulated->next(), is = recorded->next();
    ASSERT_TRUE(was && is);
    EXPECT_EQ(is->label, was->label);
    EXPECT_STREQ(is->stamp.clock, was->stamp.clock);
    EXPECT_EQ(is->stamp.mid_exposure_ns, was->stamp.mid_exposure_ns);
    EXPECT_EQ(is->stamp.exposure_start_ns, was->stamp.exposure_start_ns);
    EXPECT_EQ(is->stamp.arrival_ns, was->stamp.arrival_ns);
    ASSERT_EQ(is->truth.size(), was->truth.size());
    EXPECT_EQ(is->truth[0].corners, was->truth[0].corners);
    EXPECT_EQ(is->truth[0].pose.t, was->truth[0].pose.t);
    ASSERT_EQ(is->image.width(), was->image.width());
    for (int y = 0; y < is->image.height(); ++y) {
      ASSERT_TRUE(
          std::equal(is->image.view().row(y), is->image.view().row(y) + is->image.width(), was->image.view().row(y)));
    }
  }
  EXPECT_EQ(recorded->next(), std::nullopt);
  const CommandRun run = run_berth({"run", "--source", "mcap:" + file, "--record", file});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("it is the source itself"));
  EXPECT_TRUE(mcap::examine(file).whole);
}

/// Images as ROS' camera drivers record them.
TEST(McapSource, ReadsOthersImages) {
  const ScratchFolder folder;
  mcap::Writer writer(folder / "a.mcap", "ros2", "test");
  writer.add(mcap::Schema{1, "sensor_msgs/msg/Image", "ros2msg", ""});
  writer.add(mcap::Schema{2, "sensor_msgs/msg/CompressedImage", "ros2msg", ""});
  writer.add(mcap::Channel{1, 1, "/camera/image_raw", "cdr", {}});
  writer.add(mcap::Channel{2, 2, "/camera/image_raw/compressed", "cdr", {}});
  ros2::CdrWriter cdr;
  const auto send = [&](mcap::u16 channel) {
    writer.write({channel, 0, 0, 0, cdr.bytes().data(), cdr.bytes().size()});
  };
  const auto image = [&](const char* encoding, std::vector<u8> pixels, u32 step, u32 width = 1) {
    cdr.begin();
    cdr.int32(2);
    cdr.uint32(5);
    cdr.string("camera");
    cdr.uint32(1);  // height
    cdr.uint32(width);
    cdr.string(encoding);
    cdr.uint8(0);
    cdr.uint32(step);
    cdr.length(pixels.size());
    cdr.octets(pixels.data(), pixels.size());
    send(1);
  };
  image("mono8", {7, 9}, 2);
  image("rgb8", {255, 0, 0}, 3);
  image("bgr8", {255, 0, 0}, 3);
  image("mono16", {0, 0x80}, 2);
  image("bayer_rggb8", {1}, 1);
  image("mono8", {7}, 1, 100);
  image("mono8", {7}, 1, 1u << 30);
  writer.write({1, 0, 0, 0, cdr.bytes().data(), 9});
  writer.finish();
  const std::unique_ptr<Source> source = open_mcap(folder / "a.mcap");
  const auto next_pixel = [&] {
    const std::optional<SourceFrame> frame = source->next();
    EXPECT_EQ(frame->stamp.mid_exposure_ns, 2'000'000'005);
    EXPECT_STREQ(frame->stamp.clock, "ros");
    return int{frame->image.view().at(0, 0)};
  };
  EXPECT_EQ(next_pixel(), 7);
  EXPECT_EQ(next_pixel(), 76);
  EXPECT_EQ(next_pixel(), 29);
  EXPECT_EQ(next_pixel(), 128);
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("a.mcap#4: its encoding 'bayer_rggb8' is not supported"));
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("a.mcap#5: an image is smaller than it says"));
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("1073741824"));
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("an image is damaged"));
  EXPECT_EQ(source->next(), std::nullopt);

  mcap::Writer second(folder / "b.mcap", "ros2", "test");
  second.add(mcap::Schema{2, "sensor_msgs/msg/CompressedImage", "ros2msg", ""});
  second.add(mcap::Channel{2, 2, "/camera/image_raw/compressed", "cdr", {}});
  const std::string png = text_of(std::string(BERTH_TEST_DATA) + "/tag36h11_7.png");
  const std::vector<u8> file(png.begin(), png.end());
  ros2::write(ros2::CompressedImage{{1, "camera"}, "png", file}, cdr);
  second.write({2, 0, 0, 0, cdr.bytes().data(), cdr.bytes().size()});
  second.finish();
  EXPECT_THAT(run_berth({"run", "--source", folder / "b.mcap"}).out, HasSubstr("1 frame, 1 with markers"));
}

}  // namespace
}  // namespace berth
