// GStreamer pipelines as cameras: pictures of a marker in every format, times, ends and errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "berth/detector.hpp"
#include "camera/image_file.hpp"
#include "camera/sources.hpp"
#include "monotonic.hpp"
#include "support/complaint.hpp"
#include "support/image_digest.hpp"

namespace berth {
namespace {

using test::complaint;
using test::image_digest;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kImage = BERTH_TEST_DATA "/tag36h11_7.png";
constexpr int kWidth = 320, kHeight = 240;

/// For sources that are not to be given up, however busy the machine.
const std::string kPatient = "gst:watchdog_ms=30000;";
/// The picture again and again, 100 times a second.
const std::string kPicture =
    "multifilesrc location=" + kImage + " loop=true caps=image/png,framerate=100/1 ! pngdec ! videoconvert";

std::string in_format(const std::string& format) { return kPicture + " ! video/x-raw,format=" + format; }

/// What the source complains of next; frames that come before are passed over.
std::string next_complaint(Source& source) {
  for (;;) {
    std::string text = complaint([&] { source.next(); });
    if (!text.empty()) return text;
  }
}

SourceFrame next_frame(Source& source) {
  std::optional<SourceFrame> frame;
  while (!frame) complaint([&] { frame = source.next(); });
  return *frame;
}

TEST(GstOptions, ReadsKeysBeforeThePipeline) {
  const GstOptions options = parse_gst("exposure_us=2000,buffers=3,watchdog_ms=250; v4l2src ! video/x-raw,width=640");
  EXPECT_EQ(options.exposure_us, 2000);
  EXPECT_EQ(options.buffers, 3);
  EXPECT_EQ(options.watchdog_ms, 250);
  EXPECT_EQ(options.pipeline, "v4l2src ! video/x-raw,width=640");
  EXPECT_EQ(name_of(options), "gst:v4l2src");
  // What a pipeline itself has of ';' and '='.
  const std::string plain = "videotestsrc num-buffers=2 ! video/x-raw,format=GRAY8;video/x-raw,format=BGR";
  EXPECT_EQ(parse_gst(plain).pipeline, plain);
  EXPECT_EQ(parse_gst(plain).watchdog_ms, 1000);
}

TEST(GstOptions, SaysWhatIsWrong) {
  const auto message = [](const std::string& text) { return complaint([&] { parse_gst(text); }); };
  EXPECT_THAT(message(""), AllOf(HasSubstr("gst:"), HasSubstr("gst-launch-1.0")));
  EXPECT_THAT(message("buffers=2; "), HasSubstr("give a pipeline"));
  EXPECT_THAT(message("buffers=2 videotestsrc"), HasSubstr("';'"));
  EXPECT_THAT(message("buffers=1;videotestsrc"), AllOf(HasSubstr("gst:…,buffers"), HasSubstr("from 2 to 64")));
  EXPECT_THAT(message("speed=1;videotestsrc"), AllOf(HasSubstr("speed"), HasSubstr("watchdog_ms")));
}

TEST(Gst, GivesThePictureInEveryFormat) {
  const GrayImage expected = read_gray_image(kImage);
  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.camera = paper_camera(kWidth, kHeight);
  config.marker_size_m = 0.1;
  Detector detector(*backend, kWidth, kHeight, config);
  const FrameResult direct = detector.detect(expected.view());
  ASSERT_EQ(direct.detections.size(), 1U);
  ASSERT_TRUE(direct.detections[0].has_pose);
  for (const std::string& format : gst_formats()) {
    const SourceFrame frame = *open_source(kPatient + in_format(format))->next();
    ASSERT_EQ(frame.image.width(), kWidth) << format;
    ASSERT_EQ(frame.image.height(), kHeight) << format;
    EXPECT_EQ(image_digest(frame.image), image_digest(expected)) << format;
    const FrameResult received = detector.detect(frame.image.view());
    ASSERT_EQ(received.detections.size(), 1U) << format;
    EXPECT_EQ(received.detections[0].id, 7) << format;
    EXPECT_EQ(received.detections[0].corners, direct.detections[0].corners) << format;
    EXPECT_EQ(received.detections[0].pose.t, direct.detections[0].pose.t) << format;
  }
}

TEST(Gst, ReadsRowsThatEndInPadding) {
  const GrayImage whole = read_gray_image(kImage);
  for (const char* format : {"GRAY8", "BGR"}) {
    const std::string pipeline = in_format(format).append(" ! videocrop left=1 top=2");
    const SourceFrame frame = *open_source(kPatient + pipeline)->next();
    ASSERT_EQ(frame.image.width(), kWidth - 1);
    ASSERT_EQ(frame.image.height(), kHeight - 2);
    int differing = 0;
    for (int y = 0; y < kHeight - 2; ++y) {
      for (int x = 0; x < kWidth - 1; ++x) {
        differing += frame.image.view().at(x, y) != whole.view().at(x + 1, y + 2) ? 1 : 0;
      }
    }
    EXPECT_EQ(differing, 0) << format;
  }
}

TEST(Gst, TakesTimesFromThePipeline) {
  // Played at its own pace, and live.
  for (const char* live : {"false", "true"}) {
    const std::int64_t start_ns = monotonic_ns();
    const auto source = open_source("gst:exposure_us=4000,watchdog_ms=30000;videotestsrc is-live=" + std::string(live) +
                                    " ! video/x-raw,format=GRAY8,width=32,height=16,framerate=50/1");
    std::int64_t first_ns = 0;
    FrameStamp last;
    for (int i = 0; i < 4; ++i) {
      const SourceFrame frame = *source->next();
      EXPECT_EQ(frame.label, "gst:videotestsrc#" + std::to_string(i));
      EXPECT_STREQ(frame.stamp.clock, "monotonic");
      EXPECT_EQ(frame.stamp.mid_exposure_ns - frame.stamp.exposure_start_ns, 2'000'000);
      if (i == 0) first_ns = frame.stamp.exposure_start_ns;
      last = frame.stamp;
      EXPECT_GE(last.exposure_start_ns + 4'000'000, start_ns);
      EXPECT_GE(last.arrival_ns, last.exposure_start_ns + 4'000'000) << "none comes before its time";
    }
    // Whole frames of 20 ms; which of them were skipped depends on the machine.
    const std::int64_t passed = last.exposure_start_ns - first_ns;
    EXPECT_GE(passed, 60'000'000);
    EXPECT_EQ(passed % 20'000'000, 0);
  }
}

TEST(Gst, HoldsTheNewestFrames) {
  // Faster than anything here: the ring runs over all the time.
  const auto source = open_source(
      "gst:buffers=2,watchdog_ms=30000;videotestsrc ! video/x-raw,format=GRAY8,width=32,height=16,framerate=2000/1");
  u64 taken = 0;
  std::int64_t first_ns = 0, last_ns = 0;
  while (source->health().skipped == 0 || source->health().lost == 0) {
    const SourceFrame frame = *source->next();
    if (++taken == 1) first_ns = frame.stamp.mid_exposure_ns;
    last_ns = frame.stamp.mid_exposure_ns;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  // All between the first and the last are accounted for; skipped ones may have come before the first.
  const SourceHealth health = source->health();
  const auto between = static_cast<u64>((last_ns - first_ns) / 500'000);
  EXPECT_GE(taken - 1 + health.skipped + health.lost, between);
  EXPECT_LE(taken - 1 + health.skipped + health.lost, between + 1);
}

TEST(Gst, PlaysAgainWhatHasEnded) {
  const auto source =
      open_source("gst:videotestsrc num-buffers=3 ! video/x-raw,format=GRAY8,width=32,height=16,framerate=100/1");
  ASSERT_TRUE(source->next());
  EXPECT_THAT(
      next_complaint(*source),
      AllOf(StartsWith("gst:videotestsrc: the camera is lost (its pipeline has ended)"), HasSubstr("opened again")));
  EXPECT_GE(next_frame(*source).stamp.sequence, 1U) << "goes on counting";
  EXPECT_EQ(source->health().reopened, 1U);
  EXPECT_EQ(source->health().lost, 0U);
}

TEST(Gst, BuildsAnewWhatFailed) {
  const auto source = open_source("gst:" + kPicture + " ! identity error-after=4");
  ASSERT_TRUE(source->next());
  EXPECT_THAT(next_complaint(*source), HasSubstr("the camera is lost (Failed after iterations as requested"));
  EXPECT_EQ(image_digest(next_frame(*source).image), image_digest(read_gray_image(kImage)));
  EXPECT_EQ(source->health().reopened, 1U);
}

TEST(Gst, IsGivenUpWhenItIsSilent) {
  // A second from one frame to the next.
  const auto source =
      open_source("gst:watchdog_ms=50;videotestsrc ! video/x-raw,format=GRAY8,width=32,height=16,framerate=1/1");
  EXPECT_THAT(next_complaint(*source), HasSubstr("no whole frame for 50 ms"));
}

TEST(Gst, SaysWhatIsWrongWithAPipeline) {
  const auto refusal = [](const std::string& pipeline) { return complaint([&] { open_source("gst:" + pipeline); }); };
  EXPECT_THAT(
      refusal("nosuchsrc ! videoconvert"),
      AllOf(StartsWith("gst:nosuchsrc: "), HasSubstr("no element \"nosuchsrc\""), HasSubstr("gst-inspect-1.0")));
  EXPECT_THAT(refusal("videotestsrc ! fakesink"), HasSubstr("without a sink"));
  EXPECT_THAT(refusal("videotestsrc ! video/x-raw,format=RGB15"),
              AllOf(HasSubstr("GRAY8, NV12"), HasSubstr("videoconvert")));
  EXPECT_THAT(refusal("multifilesrc location=/nowhere/%d.png ! pngdec"), HasSubstr("gives no frame"));
  EXPECT_THAT(refusal("videotestsrc num-buffers=0"), HasSubstr("its pipeline has ended"));
}

}  // namespace
}  // namespace berth
