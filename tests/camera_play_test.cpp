// A camera's frames through the pipeline: written once, where the device takes them from.
#include "camera_play.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <sstream>

#include "berth/error.hpp"
#include "frame/result_digest.hpp"
#include "frame_observer.hpp"
#include "stream.hpp"
#include "support/counted_allocations.hpp"
#include "support/fake_v4l2.hpp"
#include "support/pipeline_frames.hpp"

namespace berth::cli {
namespace {

using test::FakeFrame;
using test::FakeV4l2;
using test::pipeline::kHeight;
using test::pipeline::kWidth;
using test::pipeline::picture;
using testing::HasSubstr;

/// A frame of the camera, rows `kStride` bytes apart.
constexpr std::uint32_t kStride = kWidth + 8;

FakeFrame frame_of(u64 i) {
  FakeFrame frame{std::vector<u8>(std::size_t{kStride} * kHeight), static_cast<std::uint32_t>(i), 0};
  for (int y = 0; y < kHeight; ++y) {
    std::memcpy(frame.bytes.data() + std::size_t{kStride} * static_cast<std::size_t>(y), picture(i).row(y), kWidth);
  }
  return frame;
}

FakeV4l2 camera_of(std::size_t frames) {
  FakeV4l2 camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.stride = kStride;
  camera.buffer_bytes = kStride * kHeight;
  for (u64 i = 0; i < frames; ++i) camera.frames.push_back(frame_of(i));
  return camera;
}

std::unique_ptr<CameraSource> opened(FakeV4l2& camera) {
  V4l2Options options = parse_v4l2("/dev/video7,format=GREY,buffers=2,repeats=on");
  options.watchdog_ms = 20;
  return open_v4l2(options, test::opener_of(camera));
}

class Notes final : public FrameObserver {
 public:
  void observe(const ObservedFrame& frame) override {
    labels.push_back(frame.label);
    digests.push_back(frame.digest);
    EXPECT_NE(frame.paced, nullptr);
    EXPECT_EQ(frame.image.width, kWidth);
  }
  std::vector<std::string> labels;
  std::vector<u64> digests;
};

TEST(CameraPlay, FramesHaveTheDetectorsBits) {
  FakeV4l2 camera = camera_of(0);
  camera.endless = frame_of(3);
  const std::unique_ptr<CameraSource> source = opened(camera);
  const auto notes = std::make_shared<Notes>();
  StreamOptions options;
  options.engine.backend = "simd";
  options.pace.stream = true;
  options.track = true;
  options.max_frames = 10;
  options.observers.push_back(notes);
  std::ostringstream out, err;
  Console console(out, err, false);
  const StreamSum sum = run_stream(*source, options, console);
  EXPECT_EQ(err.str(), "");
  EXPECT_THAT(out.str(), HasSubstr("280x210, each frame straight into a slot"));
  EXPECT_THAT(out.str(), HasSubstr("10 frames offered, "));
  EXPECT_THAT(out.str(), HasSubstr("latency"));
  ASSERT_GE(sum.frames, 1u);
  EXPECT_EQ(sum.with_markers, sum.frames);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector detector(*backend, kWidth, kHeight, {});
  const u64 wanted = digest_of(detector.detect(picture(3)));
  for (const u64 digest : notes->digests) EXPECT_EQ(digest, wanted);
  EXPECT_THAT(notes->labels, testing::Each(testing::StartsWith("/dev/video7#")));
}

TEST(CameraPlay, SaysWhenTheCameraIsLostAndGoesOnWhenItIsBack) {
  FakeV4l2 camera = camera_of(1);
  const std::unique_ptr<CameraSource> source = opened(camera);
  camera.when_empty = ENODEV;
  camera.closed_for = 1;
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PaceOptions pace;
  pace.stream = true;
  CameraPlay play(*source, pace, {backend.get()}, make_pipeline_config(pace, {}), 0);
  play.start();
  std::size_t frames = 0;
  std::vector<std::string> complaints;
  const auto read = [&] {
    frames += play.next() != nullptr ? 1 : 0;
    for (const std::string& complaint : play.take_complaints()) complaints.push_back(complaint);
  };
  while (complaints.size() < 3) read();  // lost, still away, there but silent
  EXPECT_EQ(frames, 1u);
  EXPECT_THAT(complaints[0], HasSubstr("/dev/video7: the camera is lost"));
  EXPECT_THAT(complaints[1], HasSubstr("cannot be opened"));
  play.end();
  while (!play.has_ended()) read();
  EXPECT_EQ(frames, 1u);
  EXPECT_GE(source->health().reopened, 1u);
}

TEST(CameraPlay, AllocatesNothingFromFrameToFrame) {
  FakeV4l2 camera = camera_of(0);
  camera.endless = frame_of(3);
  const std::unique_ptr<CameraSource> source = opened(camera);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PaceOptions pace;
  pace.stream = true;
  CameraPlay play(*source, pace, {backend.get()}, make_pipeline_config(pace, {}), 0);
  play.start();
  while (play.next() == nullptr) continue;
  const std::size_t before = test::allocations();
  std::size_t markers = 0;
  for (int frames = 0; frames < 200;) {
    const PipelineFrame* const frame = play.next();
    if (frame == nullptr) continue;
    markers += frame->result->detections.size();
    ++frames;
  }
  EXPECT_EQ(test::allocations(), before);
  EXPECT_GT(markers, 0u);
  play.end();
  while (!play.has_ended()) play.next();
}

TEST(CameraPlay, IsForCamerasAlone) {
  StreamOptions options;
  options.engine.backend = "simd";
  options.pace.stream = true;
  std::ostringstream out, err;
  Console console(out, err, false);
  const std::unique_ptr<Source> pictures = open_images({"nowhere.png"});
  EXPECT_THAT([&] { run_stream(*pictures, options, console); },
              testing::ThrowsMessage<Error>(HasSubstr("play recordings by --fps")));
  FakeV4l2 camera = camera_of(1);
  const std::unique_ptr<CameraSource> source = opened(camera);
  options.engine.lockstep = "simd,cpu";
  EXPECT_THAT([&] { run_stream(*source, options, console); },
              testing::ThrowsMessage<Error>(HasSubstr("leave --stream out")));
}

}  // namespace
}  // namespace berth::cli
