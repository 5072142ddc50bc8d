// Frames of approaches, followed in windows: what is found is the whole frame's, losses and newcomers are found out.
#include "berth/tracker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "berth/failover.hpp"
#include "sim/scenario.hpp"
#include "support/complaint.hpp"
#include "support/counted_allocations.hpp"
#include "support/faulty_backend.hpp"
#include "support/follower.hpp"
#include "support/pictures.hpp"
#include "support/same_detection.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;

using test::Follower;
using test::kHeight;
using test::kWidth;
using test::picture;
using test::Place;
using test::stamp;

std::size_t count_of(const Follower& follower, SearchReason why) {
  return follower.tracker.counts().by_reason[static_cast<std::size_t>(why)];
}

std::vector<int> ids_of(const TrackedFrame& frame) {
  std::vector<int> ids;
  for (const Detection& detection : frame.result->detections) ids.push_back(detection.id);
  return ids;
}

TEST(Tracker, AnApproachIsFollowedInWindowsWithTheWholeFramesBits) {
  const auto source = open_scenario(std::string(BERTH_SOURCE_DIR) + "/scenarios/track.toml");
  DetectorConfig config;
  config.camera = source->camera();
  config.marker_size_m = 0.1;
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector whole(*backend, 640, 480, config);
  TrackerConfig tracking;
  tracking.full_every = 6;
  config.window_sides = tracking_window_sides(640, 480, tracking);
  Detector windowed(*backend, 640, 480, config);
  Tracker tracker(640, 480, tracking);
  for (int i = 0; i < 10; ++i) {
    const SourceFrame frame = *source->next();
    const TrackedFrame& tracked = tracker.look(windowed, frame.image.view(), frame.stamp);
    const std::vector<Detection>& all = whole.detect(frame.image.view(), frame.stamp).detections;
    ASSERT_EQ(tracked.result->detections.size(), 1u) << i;
    ASSERT_EQ(all.size(), 1u) << i;
    EXPECT_TRUE(test::same_bits(tracked.result->detections[0], all[0])) << i;
    EXPECT_TRUE(tracked.result->detections[0].pose_uncertainty) << i;
  }
  EXPECT_EQ(tracker.counts().by_reason[static_cast<std::size_t>(SearchReason::none_held)], 1u);
  EXPECT_EQ(tracker.counts().by_reason[static_cast<std::size_t>(SearchReason::regular)], 1u);
  EXPECT_EQ(tracker.counts().by_reason[static_cast<std::size_t>(SearchReason::held)], 8u);
}

TEST(Tracker, WhatTheWholeImagesSearchReadsIsLookedForByItAlone) {
  Follower follower;
  const GrayImage sharp = picture({{3, 0, 0, 0.8}});
  GrayImage faint = sharp;  // too little contrast for the whole image's search
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) faint.view().at(x, y) = static_cast<u8>(120 + sharp.view().at(x, y) / 16);
  }
  int i = 0;
  const auto look = [&](const GrayImage& image) -> const TrackedFrame& { return follower.look(image, stamp(i++)); };
  for (int k = 0; k < 8; ++k) {
    const TrackedFrame& tracked = look(sharp);
    EXPECT_EQ(tracked.why, k == 0 ? SearchReason::none_held : SearchReason::held);
    for (const SearchWindow& window : tracked.windows) EXPECT_FALSE(window.full_resolution_only) << i;
  }
  {
    const TrackedFrame& tracked = look(sharp);
    EXPECT_EQ(tracked.why, SearchReason::held);
    ASSERT_EQ(tracked.windows.size(), 1u);
    EXPECT_TRUE(tracked.windows[0].full_resolution_only);
  }
  {
    const TrackedFrame& tracked = look(faint);
    EXPECT_EQ(tracked.why, SearchReason::lost);
    EXPECT_TRUE(tracked.whole);
    EXPECT_EQ(ids_of(tracked), std::vector<int>{3});
  }
  for (const bool is_faint : {true, false, true}) {
    const TrackedFrame& tracked = look(is_faint ? faint : sharp);
    EXPECT_EQ(tracked.why, SearchReason::held);
    ASSERT_EQ(tracked.windows.size(), 1u);
    EXPECT_FALSE(tracked.windows[0].full_resolution_only);
    EXPECT_EQ(tracked.result->detections.at(0).search, is_faint ? 1 : 0);
  }
}

TEST(Tracker, LossIsSearchedWholeAtOnceAndTheMarkerFoundWhenItIsBack) {
  Follower follower;
  const auto at = [](int i) { return picture({{3, 0.002 * i, 0.01, 0.8}}); };
  EXPECT_EQ(follower.look(at(0), stamp(0)).why, SearchReason::none_held);
  EXPECT_EQ(follower.look(at(1), stamp(1)).why, SearchReason::held);
  const TrackedFrame& lost = follower.look(pictures::uniform(kWidth, kHeight, 90), stamp(2));
  EXPECT_EQ(lost.why, SearchReason::lost);
  EXPECT_TRUE(lost.whole);
  EXPECT_FALSE(lost.windows.empty()) << "the window that showed nothing is reported";
  EXPECT_EQ(lost.held, 0u);
  EXPECT_EQ(follower.look(pictures::uniform(kWidth, kHeight, 90), stamp(3)).why, SearchReason::none_held);
  EXPECT_EQ(ids_of(follower.look(at(4), stamp(4))), std::vector<int>{3});
  EXPECT_EQ(follower.look(at(5), stamp(5)).why, SearchReason::held);
}

TEST(Tracker, AMarkerThatJumpsIsFoundInTheSameFrameAndCounted) {
  Follower follower;
  for (int i = 0; i < 12; ++i) {
    const double x = i / 4 % 2 == 0 ? -0.1 : 0.12;  // jumps in frames 4 and 8
    const TrackedFrame& tracked = follower.look(picture({{3, x, 0, 0.8}}), stamp(i));
    EXPECT_EQ(ids_of(tracked), std::vector<int>{3}) << i;
    EXPECT_EQ(tracked.why, i == 0       ? SearchReason::none_held
                           : i % 4 == 0 ? SearchReason::lost
                                        : SearchReason::held)
        << i;
  }
  EXPECT_EQ(count_of(follower, SearchReason::lost), 2u);
  EXPECT_EQ(count_of(follower, SearchReason::held), 9u);
}

TEST(Tracker, WithoutTimeForBothTheNextFrameIsSearchedWhole) {
  TrackerConfig tracking;
  tracking.same_frame = false;
  Follower follower(tracking);
  const auto look = [&](int i, double x) { return follower.look(picture({{3, x, 0, 0.8}}), stamp(i)); };
  look(0, -0.1);
  EXPECT_EQ(look(1, -0.1).why, SearchReason::held);
  const TrackedFrame missed = look(2, 0.12);
  EXPECT_EQ(missed.why, SearchReason::lost);
  EXPECT_FALSE(missed.whole);
  const TrackedFrame again = look(3, 0.12);
  EXPECT_EQ(again.why, SearchReason::lost);
  EXPECT_TRUE(again.whole);
  EXPECT_EQ(ids_of(again), std::vector<int>{3});
  EXPECT_EQ(look(4, 0.12).why, SearchReason::held);
}

TEST(Tracker, ANewcomerIsFoundByTheNextRegularSearch) {
  TrackerConfig tracking;
  tracking.full_every = 5;
  Follower follower(tracking);
  for (int i = 0; i < 12; ++i) {
    std::vector<Place> places = {{3, -0.15, 0, 0.8}};
    if (i >= 6) places.push_back({4, 0.15, 0.05, 0.8});
    const TrackedFrame& tracked = follower.look(picture(places), stamp(i));
    EXPECT_EQ(tracked.why, i == 0 ? SearchReason::none_held : i % 5 == 0 ? SearchReason::regular : SearchReason::held);
    EXPECT_EQ(tracked.held, i < 10 ? 1u : 2u) << i;
  }
}

TEST(Tracker, SeveralMarkersHaveWindowsOrShareThem) {
  Follower follower;
  const auto look = [&](int i, double apart) {
    return follower.look(picture({{3, -apart, 0, 0.9, 0.05}, {4, apart, 0.01, 0.9, 0.05}}), stamp(i));
  };
  look(0, 0.14);
  const TrackedFrame two = look(1, 0.14);
  EXPECT_EQ(two.windows.size(), 2u);
  EXPECT_EQ(ids_of(two), (std::vector<int>{3, 4}));
  follower.tracker.reset();
  EXPECT_EQ(look(2, 0.045).why, SearchReason::none_held);
  const TrackedFrame one = look(3, 0.045);
  EXPECT_EQ(one.windows.size(), 1u);
  EXPECT_EQ(ids_of(one), (std::vector<int>{3, 4}));
  // One of the two goes: the frame is searched whole, and the other followed on.
  const TrackedFrame gone = follower.look(picture({{4, 0.045, 0.01, 0.9, 0.05}}), stamp(4));
  EXPECT_EQ(gone.why, SearchReason::lost);
  EXPECT_EQ(gone.held, 1u);
  EXPECT_EQ(follower.look(picture({{4, 0.045, 0.01, 0.9, 0.05}}), stamp(5)).why, SearchReason::held);
}

TEST(Tracker, MoreMarkersThanWindowsAreJoined) {
  TrackerConfig tracking;
  tracking.most_windows = 2;
  Follower follower(tracking);
  std::vector<Place> places;
  for (int i = 0; i < 4; ++i) places.push_back({i, (i - 1.5) * 0.1, i % 2 * 0.08 - 0.04, 1.2, 0.03});
  follower.look(picture(places), stamp(0));
  const TrackedFrame& tracked = follower.look(picture(places), stamp(1));
  EXPECT_EQ(tracked.why, SearchReason::held);
  EXPECT_LE(tracked.windows.size(), 2u);
  EXPECT_EQ(ids_of(tracked), (std::vector<int>{0, 1, 2, 3}));
}

TEST(Tracker, TwoMarkersOfOneNumberAreTwo) {
  Follower follower;
  const std::vector<Place> both = {{3, -0.13, 0, 0.9, 0.05}, {3, 0.13, 0, 0.9, 0.05}};
  follower.look(picture(both), stamp(0));
  EXPECT_EQ(follower.look(picture(both), stamp(1)).held, 2u);
  const TrackedFrame& one = follower.look(picture({both[1]}), stamp(2));
  EXPECT_EQ(one.why, SearchReason::lost);
  EXPECT_EQ(one.held, 1u);
}

TEST(Tracker, NearTheBorderOrTooLargeTheWholeFrameIsSearched) {
  Follower follower;
  follower.look(picture({{3, -0.32, 0, 0.9}}), stamp(0));
  EXPECT_EQ(follower.look(picture({{3, -0.32, 0, 0.9}}), stamp(1)).why, SearchReason::border);
  follower.look(picture({{3, 0, 0, 0.25}}), stamp(2));
  EXPECT_EQ(follower.look(picture({{3, 0, 0, 0.25}}), stamp(3)).why, SearchReason::large);
}

TEST(Tracker, GapsAndFramesOutOfOrderAreSearchedWhole) {
  Follower follower;
  const GrayImage image = picture({{3, 0, 0, 0.8}});
  follower.look(image, stamp(0));
  EXPECT_EQ(follower.look(image, stamp(1)).why, SearchReason::held);
  EXPECT_EQ(follower.look(image, stamp(31)).why, SearchReason::gap);
  EXPECT_EQ(follower.look(image, stamp(30)).why, SearchReason::gap);
  FrameStamp other = stamp(31);
  other.clock = "another";
  EXPECT_EQ(follower.look(image, other).why, SearchReason::gap);
  // Frames without times count as one apart.
  EXPECT_EQ(follower.look(image, {}).why, SearchReason::gap);
  EXPECT_EQ(follower.look(image, {}).why, SearchReason::held);
}

TEST(Tracker, WhatOverflowsIsSearchedWhole) {
  DetectorConfig config;
  config.capacities.contours = 40;
  Follower follower({}, config);
  GrayImage image = picture({{3, 0, 0, 0.8}});
  follower.look(image, stamp(0));
  ASSERT_EQ(follower.look(image, stamp(1)).why, SearchReason::held);
  const GrayImage clutter = pictures::checkerboard(kWidth, kHeight, 9);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (std::abs(x - kWidth / 2) > 55 || std::abs(y - kHeight / 2) > 55)
        image.view().at(x, y) = clutter.view().at(x, y);
    }
  }
  const TrackedFrame& tracked = follower.look(image, stamp(2));
  EXPECT_EQ(tracked.why, SearchReason::overflow);
  EXPECT_TRUE(tracked.whole);
}

/// A marker that turns back: its corners' velocity says one thing, the pose filter's word another.
TEST(Tracker, GoesWhereAPoseFilterExpectsAMarker) {
  Follower follower;
  const CameraModel camera = paper_camera(kWidth, kHeight);
  const auto at = [](double x) { return picture({{3, x, 0, 0.9, 0.05}}); };
  follower.look(at(-0.08), stamp(0));
  follower.look(at(-0.07), stamp(1));
  FilteredPose pose;
  pose.has_pose = true;
  pose.pose.t = {0.1, 0, 0.9};
  for (std::size_t i = 0; i < 3; ++i) pose.covariance[i * 7] = 1e-6;
  follower.tracker.expect(family("tag36h11"), 3, camera, 0.05, pose);
  follower.tracker.expect(family("tag36h11"), 99, camera, 0.05, pose);  // not held: nothing happens
  const TrackedFrame& tracked = follower.look(at(0.1), stamp(2));
  EXPECT_EQ(tracked.why, SearchReason::held);
  EXPECT_EQ(ids_of(tracked), std::vector<int>{3});
  // Said once, it holds for one frame.
  EXPECT_NE(follower.look(at(0.1), stamp(3)).why, SearchReason::held);
}

TEST(Tracker, AReplayMakesTheSameSearches) {
  std::vector<std::vector<int>> runs;
  for (int run = 0; run < 2; ++run) {
    Follower follower;
    std::vector<int>& all = runs.emplace_back();
    for (int i = 0; i < 10; ++i) {
      const TrackedFrame& tracked = follower.look(picture({{3, 0.004 * i * i, 0, 0.8}}), stamp(i));
      all.push_back(static_cast<int>(tracked.why));
      for (const SearchWindow& window : tracked.windows) all.insert(all.end(), {window.x, window.y, window.side});
    }
  }
  EXPECT_EQ(runs[0], runs[1]);
}

TEST(Tracker, NothingIsAllocatedWhileFramesFly) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  DetectorConfig config;
  config.camera = paper_camera(kWidth, kHeight);
  config.marker_size_m = 0.1;
  config.window_sides = tracking_window_sides(kWidth, kHeight);
  Detector detector(*backend, kWidth, kHeight, config);
  Tracker tracker(kWidth, kHeight);
  std::vector<GrayImage> images;
  for (int i = 0; i < 8; ++i) images.push_back(picture({{3, -0.1 + 0.004 * i, 0, 0.8}, {4, 0.15, 0.05, 1.2}}));
  images.push_back(pictures::uniform(kWidth, kHeight, 80));
  const auto fly = [&] {
    for (std::size_t i = 0; i < images.size(); ++i) {
      tracker.look(detector, images[i].view(), stamp(static_cast<int>(i)));
    }
  };
  fly();  // thread-local room of the vector code
  const std::size_t before = test::allocations();
  fly();
  EXPECT_EQ(test::allocations(), before);
  EXPECT_GT(tracker.counts().by_reason[0], 10u);
}

TEST(Tracker, ALostDeviceCostsNoFrame) {
  const std::unique_ptr<Backend> simd = open_backend("simd"), cpu = open_backend("cpu");
  test::Fault fault;
  fault.lose_frame = 2;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  DetectorConfig config;
  config.window_sides = tracking_window_sides(kWidth, kHeight);
  FailoverDetector detector({faulty.get(), cpu.get()}, kWidth, kHeight, config);
  Tracker tracker(kWidth, kHeight);
  for (int i = 0; i < 5; ++i) {
    const TrackedFrame& tracked = tracker.look(detector, picture({{3, 0.002 * i, 0, 0.8}}).view(), stamp(i));
    EXPECT_EQ(ids_of(tracked), std::vector<int>{3}) << i;
    EXPECT_EQ(tracked.why, i == 0 ? SearchReason::none_held : SearchReason::held) << i;
  }
  EXPECT_EQ(detector.active(), 1u);
}

TEST(Tracker, SaysThatADeviceWasLostInWindows) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::Fault fault;
  fault.lose_frame = 1;  // of each plan: windows of a side are searched once
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  DetectorConfig config;
  config.window_sides = tracking_window_sides(kWidth, kHeight);
  Detector detector(*faulty, kWidth, kHeight, config);
  Tracker tracker(kWidth, kHeight);
  const GrayImage image = picture({{3, 0, 0, 0.8}});
  EXPECT_GT(tracker.look(detector, image.view(), stamp(0)).result->times[0].ns, 0);
  const TrackedFrame& lost = tracker.frame();
  std::size_t held = 0;
  for (int i = 1; i < 6 && tracker.look(detector, image.view(), stamp(i)).why == SearchReason::held; ++i) ++held;
  EXPECT_EQ(lost.result->status, FrameStatus::device_lost);
  EXPECT_EQ(lost.why, SearchReason::lost);
  EXPECT_FALSE(lost.whole);
  EXPECT_EQ(lost.windows.size(), 1u);
  EXPECT_EQ(tracker.counts().by_reason[static_cast<std::size_t>(SearchReason::held)], held);
  EXPECT_EQ(tracker.counts().by_reason[static_cast<std::size_t>(SearchReason::lost)], 1u);
  for (const StageTime& time : lost.result->times) {
    EXPECT_STREQ(time.stage, "") << "of the frame before";
    EXPECT_EQ(time.ns, 0);
  }
}

TEST(Tracker, RefusesWhatIsOutOfBounds) {
  const auto refusal = [](void (*change)(TrackerConfig&)) {
    TrackerConfig config;
    change(config);
    return test::complaint([&] { Tracker(kWidth, kHeight, config); });
  };
  EXPECT_THAT(refusal([](TrackerConfig& c) { c.full_every = 0; }), HasSubstr("full_every is 0"));
  EXPECT_THAT(refusal([](TrackerConfig& c) { c.most_windows = 65; }), HasSubstr("most_windows"));
  EXPECT_THAT(refusal([](TrackerConfig& c) { c.most_share = 2; }), HasSubstr("most_share"));
  EXPECT_THAT(refusal([](TrackerConfig& c) { c.most_gap_s = 0; }), HasSubstr("most_gap_s"));
  EXPECT_THAT(refusal([](TrackerConfig& c) { c.slack_px = -1; }), HasSubstr("slack_px"));
  EXPECT_EQ(refusal([](TrackerConfig&) {}), "");
}

}  // namespace
}  // namespace berth
