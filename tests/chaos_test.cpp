// Single bits turned over in a backend's memory: with lockstep none makes a wrong pose that nobody saw.
#include "verify/chaos.hpp"

#include <gtest/gtest.h>

#include "verify/chaos_scenes.hpp"

namespace berth {
namespace {

TEST(Chaos, ASmallCampaignHasNoWrongPoseThatLockstepDidNotSee) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  ChaosCampaign campaign(*backend);
  ChaosReport report;
  while (report.flips < 240) campaign.next(report, 240);
  EXPECT_EQ(report.flips, 240u);
  const ChaosTally all = report.total();
  EXPECT_EQ(all.flips, 240u);
  EXPECT_EQ(all.lockstep_wrong_pose, 0u);
  // Most flips do nothing, some do, and nearly all of these are seen on their frame.
  EXPECT_GT(all.masked, 100u);
  EXPECT_GT(all.in_lockstep, 5u);
  EXPECT_GT(all.seen_masked, 5u);
  for (const ChaosTally& t : report.regions) {
    EXPECT_EQ(t.flips, 40u);
    EXPECT_EQ(t.masked + t.by_status + t.by_crash + t.by_scrub + t.by_known_answer + t.silent, t.flips);
    EXPECT_EQ(t.masked + t.in_lockstep + t.lockstep_late + t.lockstep_silent, t.flips);
  }
  const auto& tables = report.regions[static_cast<std::size_t>(ChaosRegion::tables)];
  EXPECT_EQ(tables.silent, 0u);
}

TEST(Chaos, AFlipIsTheSameWhereverACampaignBegins) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  ChaosReport whole, parts;
  ChaosCampaign first(*backend);
  while (whole.flips < 110) first.next(whole, 110);
  {
    ChaosCampaign begun(*backend);
    while (parts.flips < 53) begun.next(parts, 53);
  }
  ChaosCampaign resumed(*backend);
  while (parts.flips < 110) resumed.next(parts, 110);
  // What an altered index or address comes to is another matter: the other regions'.
  for (const std::size_t i :
       {static_cast<std::size_t>(ChaosRegion::image), static_cast<std::size_t>(ChaosRegion::pixels)}) {
    EXPECT_EQ(parts.regions[i].masked, whole.regions[i].masked) << i;
    EXPECT_EQ(parts.regions[i].in_lockstep, whole.regions[i].in_lockstep) << i;
    EXPECT_EQ(parts.regions[i].seen_masked, whole.regions[i].seen_masked) << i;
  }
}

TEST(Chaos, ItsScenesHavePosesAndTheJudgeSeesWrongOnes) {
  const std::vector<ChaosScene> scenes = chaos_scenes(3);
  ASSERT_EQ(scenes.size(), 3u);
  const std::unique_ptr<Backend> backend = open_backend("cpu");
  Detector detector(*backend, kChaosWidth, kChaosHeight, chaos_config());
  for (const ChaosScene& scene : scenes) {
    FrameResult result = detector.detect(scene.image.view());
    EXPECT_FALSE(has_wrong_pose(scene, result)) << scene.name;
    FrameResult other = result;
    other.detections.front().id += 1;
    EXPECT_TRUE(has_wrong_pose(scene, other));
    other = result;
    for (double& t : other.detections.front().pose.t) t *= 1.06;
    EXPECT_TRUE(has_wrong_pose(scene, other));
    // Half a turn about z: the position is right.
    other = result;
    for (const std::size_t i : {0, 1, 3, 4, 6, 7}) other.detections.front().pose.R[i] *= -1;
    EXPECT_TRUE(has_wrong_pose(scene, other));
  }
}

}  // namespace
}  // namespace berth
