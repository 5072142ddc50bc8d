// Video4Linux cameras, behind a fake kernel: what they are set to, what is lost, cameras that go and come back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "berth/error.hpp"
#include "camera/sources.hpp"
#include "support/complaint.hpp"
#include "support/fake_v4l2.hpp"

namespace berth {
namespace {

using test::FakeFrame;
using test::FakeV4l2;
using test::opener_of;
using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

V4l2Options options_of(const std::string& keys = "") {
  V4l2Options options = parse_v4l2("/dev/video7" + keys);
  options.watchdog_ms = 20;
  return options;
}

FakeFrame frame_of(u8 value, std::uint32_t sequence, std::int64_t time_us = 0) {
  return {std::vector<u8>(8, value), sequence, time_us};
}

int first_pixel(const SourceFrame& frame) { return frame.image.view().at(0, 0); }

TEST(V4l2Options, NamesCamerasInWaysThatStay) {
  EXPECT_EQ(parse_v4l2("/dev/video2").path, "/dev/video2");
  EXPECT_EQ(parse_v4l2("video2").path, "/dev/video2");
  EXPECT_EQ(parse_v4l2("by-path/pci-0000:00:14.0-usb-0:1:1.0-video-index0").path,
            "/dev/v4l/by-path/pci-0000:00:14.0-usb-0:1:1.0-video-index0");
}

TEST(V4l2Options, ReadsEveryKey) {
  const V4l2Options options =
      parse_v4l2("video0,width=640,height=480,fps=59.94,format=Y10,exposure_us=2000,gain=0,buffers=3,watchdog_ms=250");
  EXPECT_EQ(options.width, 640);
  EXPECT_EQ(options.height, 480);
  EXPECT_EQ(options.fps, 59.94);
  EXPECT_EQ(options.format, "Y10");
  EXPECT_EQ(options.exposure_us, 2000);
  EXPECT_EQ(options.gain, 0);
  EXPECT_EQ(options.buffers, 3);
  EXPECT_EQ(options.watchdog_ms, 250);
}

TEST(V4l2Options, SaysWhatIsWrongWithAKey) {
  const auto message = [](const std::string& text) { return test::complaint([&] { parse_v4l2(text); }); };
  EXPECT_THAT(message(""), HasSubstr("name a camera"));
  EXPECT_THAT(message("video0,width=640"), AllOf(HasSubstr("height"), HasSubstr("missing")));
  EXPECT_THAT(message("video0,fps=fast"), AllOf(HasSubstr("fps"), HasSubstr("'fast'"), HasSubstr("frames per second")));
  EXPECT_THAT(message("video0,format=RAW"), AllOf(HasSubstr("'RAW'"), HasSubstr("GREY"), HasSubstr("MJPG")));
  EXPECT_THAT(message("video0,speed=2"), AllOf(HasSubstr("speed"), HasSubstr("exposure_us")));
  EXPECT_THAT(message("video0,buffers=1"), AllOf(HasSubstr("buffers"), HasSubstr("from 2 to 32")));
  EXPECT_THAT(message("video0,gain"), HasSubstr("KEY=VALUE"));
}

TEST(V4l2, GivesFramesWithTheirTimes) {
  FakeV4l2 camera;
  const auto source = open_v4l2(options_of(",exposure_us=2000"), opener_of(camera));
  EXPECT_EQ(camera.pixelformat, V4L2_PIX_FMT_GREY) << "the best of those offered";
  EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera.controls[V4L2_CID_EXPOSURE_ABSOLUTE], 20);

  FakeFrame ended = frame_of(7, 0, 5'000'000), begun = frame_of(8, 1, 6'000'000);
  begun.flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  camera.frames = {ended};
  SourceFrame frame = *source->next();
  EXPECT_EQ(first_pixel(frame), 7);
  EXPECT_STREQ(frame.stamp.clock, "monotonic");
  EXPECT_EQ(frame.stamp.exposure_start_ns, 4'998'000'000);
  EXPECT_EQ(frame.stamp.mid_exposure_ns, 4'999'000'000);
  camera.frames = {begun};
  frame = *source->next();
  EXPECT_EQ(frame.stamp.exposure_start_ns, 6'000'000'000);
  EXPECT_EQ(frame.stamp.mid_exposure_ns, 6'001'000'000);
  EXPECT_EQ(frame.stamp.sequence, 1U);
}

TEST(V4l2, LeavesOutPaddingAndReadsColour) {
  FakeV4l2 camera;
  camera.formats = {V4L2_PIX_FMT_YUYV};
  camera.stride = 10;
  std::vector<u8> bytes(20, 0);
  bytes[0] = 11;
  bytes[2] = 22;
  bytes[10] = 33;
  camera.frames = {{bytes, 0, 0}};
  const SourceFrame frame = *open_v4l2(options_of(), opener_of(camera))->next();
  EXPECT_EQ(frame.image.view().at(0, 0), 11);
  EXPECT_EQ(frame.image.view().at(1, 0), 22);
  EXPECT_EQ(frame.image.view().at(0, 1), 33);
}

TEST(V4l2, TakesTheNewestFrameAndCountsTheOthers) {
  FakeV4l2 camera;
  const auto source = open_v4l2(options_of(), opener_of(camera));
  camera.frames = {frame_of(1, 0), frame_of(2, 1), frame_of(3, 4)};
  EXPECT_EQ(first_pixel(*source->next()), 3);
  EXPECT_EQ(source->health().skipped, 2U);
  EXPECT_EQ(source->health().lost, 2U) << "numbers 2 and 3 were never seen";
  EXPECT_LE(camera.most_held, 2) << "all but two buffers stay with the driver";
  // Every buffer went back: the ring does not run dry.
  for (std::uint32_t i = 5; i < 50; ++i) {
    camera.frames = {frame_of(static_cast<u8>(i), i)};
    ASSERT_EQ(first_pixel(*source->next()), static_cast<int>(i));
  }
  EXPECT_EQ(source->health().lost, 2U);
}

TEST(V4l2, NeverHandsOnADamagedFrame) {
  FakeV4l2 camera;
  const auto source = open_v4l2(options_of(), opener_of(camera));
  FakeFrame damaged = frame_of(1, 0), cut = frame_of(2, 1);
  damaged.flags |= V4L2_BUF_FLAG_ERROR;
  cut.bytes.resize(7);
  camera.frames = {damaged};
  EXPECT_THROW(source->next(), Error) << "nothing came after it";
  camera.frames = {cut};
  EXPECT_THROW(source->next(), Error);
  camera.frames = {frame_of(3, 2)};
  EXPECT_EQ(first_pixel(*source->next()), 3);
  EXPECT_EQ(source->health().incomplete, 2U);
  // Of an undamaged frame and a newer one that is not whole, the older.
  damaged.sequence = 4;
  camera.frames = {frame_of(4, 3), damaged};
  EXPECT_EQ(first_pixel(*source->next()), 4);
  EXPECT_EQ(source->health().incomplete, 3U);
  EXPECT_EQ(source->health().skipped, 0U);
}

TEST(V4l2, TakesACameraThatGivesNothingWholeForLost) {
  FakeV4l2 camera;
  const auto source = open_v4l2(options_of(), opener_of(camera));
  FakeFrame damaged = frame_of(1, 0);
  damaged.flags |= V4L2_BUF_FLAG_ERROR;
  camera.endless = damaged;
  EXPECT_THAT([&] { source->next(); }, ThrowsMessage<Error>(HasSubstr("no whole frame for 20 ms")));
  EXPECT_GT(source->health().incomplete, 0U);
}

TEST(V4l2, WritesFramesWhereTheyAreWanted) {
  FakeV4l2 camera;
  camera.stride = 10;
  const auto source = open_v4l2(options_of(), opener_of(camera));
  EXPECT_EQ(source->width(), 4);
  EXPECT_EQ(source->height(), 2);
  std::vector<u8> bytes(20, 9);
  bytes[3] = 44;
  std::vector<u8> slot(32, 1);
  const View2D<u8> image{slot.data(), 4, 2, 16};  // rows further apart than they are long
  FakeFrame cut{std::vector<u8>(7), 0, 0};
  camera.frames = {cut};
  source->await();
  EXPECT_FALSE(source->fetch(image));
  camera.frames = {{bytes, 1, 5'000'000}};
  const FrameStamp stamp = source->await();
  EXPECT_TRUE(source->fetch(image));
  EXPECT_EQ(image.at(3, 0), 44);
  EXPECT_EQ(image.at(0, 1), 9);
  EXPECT_EQ(slot[4], 1) << "nothing between the rows";
  EXPECT_EQ(stamp.mid_exposure_ns, 5'000'000'000);
  EXPECT_EQ(source->label_of(stamp), "/dev/video7#1");
  EXPECT_EQ(source->health().incomplete, 1U);
  camera.frames = {{bytes, 2, 0}};
  source->await();
  EXPECT_THAT(
      [&] {
        source->fetch({slot.data(), 2, 2, 2});
      },
      ThrowsMessage<Error>(AllOf(HasSubstr("4x2 now, not 2x2"), HasSubstr("width and height"))));
  FakeFrame short_one{std::vector<u8>(7), 3, 0};
  camera.endless = short_one;
  const auto exhaust = [&] {
    for (;;) {
      source->await();
      source->fetch(image);
    }
  };
  EXPECT_THAT(exhaust, ThrowsMessage<Error>(HasSubstr("no whole frame for 20 ms")));
}

TEST(V4l2, OpensACameraAgainThatWentAway) {
  FakeV4l2 camera;
  const auto source = open_v4l2(options_of(), opener_of(camera));
  camera.frames = {frame_of(1, 90)};
  EXPECT_EQ(first_pixel(*source->next()), 1);
  camera.when_empty = ENODEV;
  EXPECT_THAT([&] { source->next(); }, ThrowsMessage<Error>(AllOf(HasSubstr("/dev/video7"), HasSubstr("lost"))));
  EXPECT_FALSE(camera.streaming) << "closed";
  camera.closed_for = 1;
  EXPECT_THROW(source->next(), Error) << "still away";
  camera.when_empty = ETIMEDOUT;
  camera.frames = {frame_of(2, 0)};
  const SourceFrame frame = *source->next();
  EXPECT_EQ(first_pixel(frame), 2);
  EXPECT_EQ(frame.stamp.sequence, 1U) << "goes on counting";
  EXPECT_EQ(source->health().reopened, 1U);
  EXPECT_EQ(source->health().lost, 0U) << "a camera begins anew at 0";
}

TEST(V4l2, TakesAFrozenCameraForLost) {
  FakeV4l2 camera;
  const auto source = open_v4l2(options_of(), opener_of(camera));
  EXPECT_THAT([&] { source->next(); }, ThrowsMessage<Error>(HasSubstr("no whole frame for 20 ms")));
  camera.frames = {frame_of(5, 0)};
  EXPECT_EQ(first_pixel(*source->next()), 5);
  EXPECT_EQ(camera.opened, 2);
}

std::string refusal(FakeV4l2 camera, const std::string& keys = "") {
  try {
    open_v4l2(options_of(keys), opener_of(camera));
  } catch (const Error& error) {
    return error.what();
  }
  return "opened";
}

TEST(V4l2, SaysWhatTheCameraDoesNotDo) {
  FakeV4l2 camera;
  EXPECT_EQ(refusal(camera, ",width=4,height=2,fps=30"), "opened");
  EXPECT_THAT(refusal(camera, ",format=Y16"), AllOf(HasSubstr("no pixel format Y16"), HasSubstr("YUYV, GREY")));
  EXPECT_THAT(refusal(camera, ",gain=3"), HasSubstr("does not take gain"));

  FakeV4l2 metadata;
  metadata.capabilities = V4L2_CAP_STREAMING;
  EXPECT_THAT(refusal(metadata), HasSubstr("gives no images"));

  FakeV4l2 compressed;
  compressed.formats = {V4L2_PIX_FMT_H264};
  EXPECT_THAT(refusal(compressed), AllOf(HasSubstr("H264"), HasSubstr("none of which")));

  FakeV4l2 small;
  small.only_width = 2;
  EXPECT_THAT(refusal(small, ",width=4,height=2"), AllOf(HasSubstr("4x2 GREY"), HasSubstr("gives 2x2")));

  FakeV4l2 slow;
  slow.only_rate = 15;
  EXPECT_THAT(refusal(slow, ",fps=30"), AllOf(HasSubstr("asked for 30"), HasSubstr("gives 15")));

  for (const unsigned long request :
       {VIDIOC_QUERYCAP, VIDIOC_G_FMT, VIDIOC_S_FMT, VIDIOC_REQBUFS, VIDIOC_QUERYBUF, VIDIOC_QBUF, VIDIOC_STREAMON}) {
    FakeV4l2 broken;
    broken.refused = request;
    EXPECT_THAT(refusal(broken), HasSubstr("/dev/video7: ")) << request;
  }
}

TEST(V4l2, SaysWhyADeviceCannotBeOpened) {
  EXPECT_THAT([] { open_v4l2(parse_v4l2("/dev/no-such-camera")); },
              ThrowsMessage<Error>(AllOf(HasSubstr("/dev/no-such-camera"), HasSubstr("by-path"))));
  // A file that is there, and no camera.
  EXPECT_THAT([] { open_v4l2(parse_v4l2("/dev/null")); }, ThrowsMessage<Error>(HasSubstr("no camera")));
}

}  // namespace
}  // namespace berth
