// The detector as its users meet it: sizes, capacities, several at once, digests.
#include "berth/detector.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "berth/error.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/pictures.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::unique_ptr<Backend> simd() { return open_backend("simd"); }

sim::Scene easy_scene() { return sim::corpus_scene("easy", 3, 640, 480); }

TEST(Detector, FindsASimulatedMarkerAndItsPose) {
  const sim::Scene scene = easy_scene();
  const GrayImage image = sim::render(scene);
  const std::vector<TruthMarker> truth = sim::truth(scene);
  ASSERT_EQ(truth.size(), 1u);
  DetectorConfig config;
  config.camera = scene.camera;
  config.marker_size_m = truth[0].size_m;
  const std::unique_ptr<Backend> backend = simd();
  Detector detector(*backend, 640, 480, config);
  const FrameResult& result = detector.detect(image.view());
  ASSERT_EQ(result.detections.size(), 1u);
  const Detection& found = result.detections[0];
  EXPECT_EQ(result.status, FrameStatus::ok);
  EXPECT_EQ(found.id, truth[0].id);
  ASSERT_TRUE(found.has_pose);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(found.pose.t[i], truth[0].pose.t[i], 0.02 * truth[0].pose.t[2]) << "axis " << i;
  }
}

TEST(Detector, AMarkerCutByTheBorderIsNotReported) {
  const sim::Scene scene = easy_scene();
  const GrayImage image = sim::render(scene);
  const TruthMarker marker = sim::truth(scene).at(0);
  double right = 0;  // the middle of the rightmost side
  for (std::size_t k = 0; k < 4; ++k)
    right = std::max(right, (marker.corners[k][0] + marker.corners[(k + 1) % 4][0]) / 2);
  const std::unique_ptr<Backend> backend = simd();
  for (int shown = -6; shown <= 24; shown += 2) {  // columns right of it
    const int width = static_cast<int>(right) + 1 + shown;
    Detector detector(*backend, width, 480, {});
    const std::size_t found = detector.detect({image.view().data, width, 480, 640}).detections.size();
    if (shown < -3) {  // nearer, part of an oblique side is still seen
      EXPECT_EQ(found, 0u) << shown;
    }
    if (shown > 20) {
      EXPECT_EQ(found, 1u) << shown;
    }
  }
}

TEST(Detector, RefusesWhatItCannotDo) {
  const std::unique_ptr<Backend> backend = simd();
  EXPECT_THAT([&] { Detector(*backend, 0, 480, {}); }, ThrowsMessage<Error>(HasSubstr("image size 0x480")));
  EXPECT_THAT([&] { Detector(*backend, 640, 16385, {}); }, ThrowsMessage<Error>(HasSubstr("16384")));
  DetectorConfig unknown;
  unknown.families = {"tag36h12"};
  EXPECT_THAT([&] { Detector(*backend, 64, 48, unknown); }, ThrowsMessage<Error>(HasSubstr("tag36h11")));
  DetectorConfig none;
  none.families = {};
  EXPECT_THAT([&] { Detector(*backend, 64, 48, none); }, ThrowsMessage<Error>(HasSubstr("no marker family")));
  DetectorConfig sizeless;
  sizeless.camera = paper_camera();
  EXPECT_THAT([&] { Detector(*backend, 64, 48, sizeless); }, ThrowsMessage<Error>(HasSubstr("marker size")));
  DetectorConfig crowded;
  crowded.capacities.contours = 1 << 20;
  EXPECT_THAT([&] { Detector(*backend, 64, 48, crowded); }, ThrowsMessage<Error>(HasSubstr("capacity 'contours'")));
  DetectorConfig uneven;
  uneven.flat_field = {1.0F, 2.0F};
  EXPECT_THAT([&] { Detector(*backend, 64, 48, uneven); }, ThrowsMessage<Error>(HasSubstr("flat field has 2 gains")));
  Detector detector(*backend, 64, 48, {});
  EXPECT_THAT([&] { detector.detect(pictures::uniform(65, 48, 9).view()); }, ThrowsMessage<Error>(HasSubstr("65x48")));
}

TEST(Detector, ReportsOverflowWithWhatWasNeeded) {
  DetectorConfig config;
  config.capacities.contours = 5;
  const std::unique_ptr<Backend> backend = simd();
  Detector detector(*backend, 300, 220, config);
  const FrameResult& result = detector.detect(pictures::checkerboard(300, 220, 9).view());
  EXPECT_EQ(result.status, FrameStatus::overflow);
  EXPECT_STREQ(result.capacities[1].what, "contours");
  EXPECT_GT(result.capacities[1].needed, 5u);
  EXPECT_EQ(result.capacities[1].capacity, 5u);
}

TEST(Detector, AFrameLeavesNothingBehind) {
  const GrayImage marker = sim::render(easy_scene());
  const GrayImage clutter = pictures::mazes(640, 480, 3);
  const std::unique_ptr<Backend> backend = simd();
  DetectorConfig config;
  config.digests = true;
  Detector fresh(*backend, 640, 480, config);
  Detector used(*backend, 640, 480, config);
  used.detect(clutter.view());
  const FrameResult& after_clutter = used.detect(marker.view());
  const FrameResult& first = fresh.detect(marker.view());
  ASSERT_EQ(first.digests.size(), after_clutter.digests.size());
  for (std::size_t i = 0; i < first.digests.size(); ++i) {
    EXPECT_EQ(first.digests[i].digest, after_clutter.digests[i].digest) << first.digests[i].stage;
  }
}

TEST(Detector, TwoAtOnceKeepApart) {
  const GrayImage marker = sim::render(easy_scene());
  const GrayImage flat = pictures::uniform(640, 480, 100);
  const std::unique_ptr<Backend> backend = simd();
  Detector a(*backend, 640, 480, {});
  Detector b(*backend, 640, 480, {});
  a.submit(marker.view(), {});
  b.submit(flat.view(), {});
  EXPECT_EQ(b.collect().status, FrameStatus::no_target);
  EXPECT_EQ(a.collect().detections.size(), 1u);
}

/// One number for each corpus's first frame, through every stage: the same on every backend, compiler and machine.
/// When it changes, the commit says which stages moved and why.
TEST(Detector, GoldenDigests) {
  struct Golden {
    const char* corpus;
    u64 digest;
  };
  const Golden goldens[] = {{"easy", 0xf50713d8a1947adc}, {"hard", 0x416ebfe22fb9cd09}, {"tiny", 0xbbf4db618c405542}};
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty()) continue;
    const std::unique_ptr<Backend> backend = open_backend(status.name);
    DetectorConfig config;
    config.families = {"tag36h11", "tagStandard41h12"};
    config.digests = true;
    Detector detector(*backend, 320, 240, config);
    for (const Golden& golden : goldens) {
      const GrayImage image = sim::render(sim::corpus_scene(golden.corpus, 0, 320, 240));
      u64 all = 0;
      for (const StageDigest& stage : detector.detect(image.view()).digests) all = all * 31 + stage.digest;
      EXPECT_EQ(all, golden.digest) << status.name << " " << golden.corpus << std::hex << " 0x" << all;
    }
  }
}

}  // namespace
}  // namespace berth
