// Markers followed in windows with frames in flight: the same frames have the same searches, whatever the threads do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <thread>

#include "berth/error.hpp"
#include "berth/pipeline.hpp"
#include "frame/detector_parts.hpp"
#include "sim/render.hpp"
#include "support/counted_allocations.hpp"
#include "support/faulty_backend.hpp"
#include "support/pictures.hpp"
#include "support/same_detection.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kWidth = 480, kHeight = 360;
constexpr u64 kFrames = 24;

/// A marker moves to the right, jumps in frame 9 and is away in frame 13; from frame 4 on there is another one.
GrayImage drawn(u64 i) {
  if (i == 13) return pictures::uniform(kWidth, kHeight, 90);
  sim::Scene scene;
  scene.camera = paper_camera(kWidth, kHeight);
  sim::SceneMarker marker;
  marker.id = 3;
  marker.size_m = 0.08;
  marker.margin_modules = 1;
  marker.pose.t = {(i < 9 ? -0.2 : 0.02) + 0.004 * static_cast<double>(i), 0.06, 0.9};
  scene.markers.push_back(marker);
  marker.id = 4;
  marker.pose.t = {0.05, -0.09, 0.9};
  if (i >= 4) scene.markers.push_back(marker);
  static const sim::Renderer renderer(scene.camera);
  return renderer.render(scene);
}

View2D<const u8> picture(u64 i) {
  static const std::vector<GrayImage> all = [] {
    std::vector<GrayImage> images;
    for (u64 k = 0; k < kFrames; ++k) images.push_back(drawn(k));
    return images;
  }();
  return all[i % kFrames].view();
}

FrameStamp stamp(u64 i) {
  FrameStamp result;
  result.sequence = i;
  result.mid_exposure_ns = static_cast<std::int64_t>(i) * 16'000'000;
  result.clock = "test";
  return result;
}

DetectorConfig posing() {
  DetectorConfig config;
  config.camera = paper_camera(kWidth, kHeight);
  config.marker_size_m = 0.08;
  return config;
}

TrackerConfig tracking(int behind) {
  TrackerConfig config;
  config.full_every = 6;
  config.behind = behind;
  return config;
}

/// What was searched in a frame, and what it showed.
struct Searched {
  SearchReason why;
  bool whole;
  std::vector<int> windows;
  std::vector<Detection> found;
};

Searched searched(const TrackedFrame& tracked, const FrameResult& result) {
  Searched one{tracked.why, tracked.whole, {}, result.detections};
  for (const SearchWindow& window : tracked.windows)
    one.windows.insert(one.windows.end(), {window.side, window.x, window.y});
  return one;
}

/// Every frame ordered as soon as it may be: `behind` are in flight all the time.
std::vector<Searched> by_hand(int behind) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  DetectorConfig config = posing();
  config.window_sides = tracking_window_sides(kWidth, kHeight, tracking(behind));
  Detector detector(*backend, kWidth, kHeight, config);
  Tracker tracker(kWidth, kHeight, tracking(behind));
  std::deque<SearchOrder> flying;
  std::vector<Searched> all;
  const auto land = [&] {
    SearchOrder& order = flying.front();
    const View2D<const u8> image = picture(order.stamp.sequence);
    while (!tracker.take(order, detector.detect(image, order.stamp, order.windows))) continue;
    all.push_back(searched(tracker.frame(), *tracker.frame().result));
    flying.pop_front();
  };
  for (u64 i = 0; i < kFrames; ++i) {
    tracker.next(stamp(i), flying.emplace_back());
    if (flying.size() == static_cast<std::size_t>(behind)) land();
  }
  while (!flying.empty()) land();
  return all;
}

std::vector<Searched> by_pipeline(const std::vector<Backend*>& backends, int behind, int slots, int rounds = 1) {
  PipelineConfig config;
  config.detector = posing();
  config.tracking = tracking(behind);
  config.slots = slots;
  config.overrun = Overrun::wait;
  std::vector<Searched> all;
  Pipeline pipeline(backends, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
    EXPECT_EQ(frame.tracked->result, frame.result);
    all.push_back(searched(*frame.tracked, *frame.result));
    if (all.size() % 5 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(3));  // a reader that holds it up
  });
  for (int round = 0; round < rounds; ++round) {
    all.clear();
    pipeline.start();
    for (u64 i = 0; i < kFrames; ++i) EXPECT_TRUE(pipeline.push(picture(i), stamp(i)));
    pipeline.stop();
  }
  return all;
}

void expect_same(const std::vector<Searched>& found, const std::vector<Searched>& wanted) {
  ASSERT_EQ(found.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_EQ(found[i].why, wanted[i].why) << i << ": " << name_of(found[i].why) << ", not " << name_of(wanted[i].why);
    EXPECT_EQ(found[i].whole, wanted[i].whole) << i;
    EXPECT_EQ(found[i].windows, wanted[i].windows) << i;
    ASSERT_EQ(found[i].found.size(), wanted[i].found.size()) << i;
    for (std::size_t k = 0; k < wanted[i].found.size(); ++k) {
      EXPECT_TRUE(test::same_bits(found[i].found[k], wanted[i].found[k])) << i;
    }
  }
}

TEST(PipelineTracking, TheSameFramesHaveTheSameSearchesWhateverIsInFlight) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  for (const int behind : {1, 2, 3}) {
    SCOPED_TRACE(behind);
    const std::vector<Searched> wanted = by_hand(behind);
    expect_same(by_pipeline({backend.get()}, behind, behind + 1), wanted);
    expect_same(by_pipeline({backend.get()}, behind, 6, 2), wanted);  // started again, it holds nothing
    const auto many = std::count_if(wanted.begin(), wanted.end(), [](const Searched& s) { return !s.whole; });
    EXPECT_GE(many, 10) << "searched in windows alone";
  }
}

TEST(PipelineTracking, MarkersHeldAreFoundInEveryFrameWithTheWholeFramesBits) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector whole(*backend, kWidth, kHeight, posing());
  for (const int behind : {1, 2}) {
    const std::vector<Searched> found = by_pipeline({backend.get()}, behind, 4);
    ASSERT_EQ(found.size(), kFrames);
    bool held = false;  // the second marker, from the first whole search that showed it on
    for (u64 i = 0; i < kFrames; ++i) {
      SCOPED_TRACE(i);
      const std::vector<Detection> all = whole.detect(picture(i)).detections;
      for (const Detection& d : found[i].found) {
        EXPECT_TRUE(
            std::any_of(all.begin(), all.end(), [&](const Detection& other) { return test::same_bits(d, other); }));
        held = held || d.id == 4;
      }
      EXPECT_EQ(found[i].found.size(), i == 13 ? 0u : held ? 2u : 1u);
      EXPECT_TRUE(!found[i].whole || found[i].found.size() == all.size());
    }
    EXPECT_TRUE(held);
    EXPECT_EQ(found[9].why, SearchReason::lost) << "the jump";
    EXPECT_EQ(found[13].why, SearchReason::lost);
    EXPECT_TRUE(found[9].whole && !found[9].windows.empty()) << "searched again in the same frame";
  }
}

TEST(PipelineTracking, ALostDeviceChangesNoSearch) {
  const std::unique_ptr<Backend> simd = open_backend("simd"), cpu = open_backend("cpu");
  test::Fault fault;
  fault.lose_frame = 1;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  expect_same(by_pipeline({faulty.get(), cpu.get()}, 2, 4), by_hand(2));
}

TEST(PipelineTracking, NothingIsAllocatedOnceStarted) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.detector = posing();
  config.tracking = tracking(2);
  config.overrun = Overrun::wait;
  picture(0);  // drawn by now
  std::array<u64, kSearchReasons> why = {};
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config,
                    [&](const PipelineFrame& frame) { ++why[static_cast<std::size_t>(frame.tracked->why)]; });
  pipeline.start();
  const std::size_t started = test::allocations();
  constexpr u64 kPlayed = 20 * kFrames;
  for (u64 i = 0; i < kPlayed; ++i) pipeline.push(picture(i), stamp(i));
  pipeline.close();
  while (pipeline.counts().delivered < kPlayed) std::this_thread::yield();
  EXPECT_EQ(test::allocations(), started);
  pipeline.stop();
  EXPECT_GE(why[static_cast<std::size_t>(SearchReason::held)], 200u);
  EXPECT_GE(why[static_cast<std::size_t>(SearchReason::lost)], 20u);
}

TEST(PipelineTracking, WindowsShareTheMemoryThatTheHostDoesNotRead) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.slots = 3;
  config.tracking = tracking(2);
  const auto of_a_slot = [&] { return Pipeline({backend.get()}, kWidth, kHeight, config).memory().device_bytes / 3; };
  const std::size_t shared = of_a_slot();
  config.detector.digests = true;  // every stage's output is read
  const std::size_t apart = of_a_slot();
  const std::size_t whole = Detector(*backend, kWidth, kHeight, {}).device_bytes();
  EXPECT_GT(shared, whole);
  EXPECT_LT(2 * (shared - whole), apart - whole);
}

TEST(PipelineTracking, ResultsHaveRoomForAsManyWindowsAsAFrameMayHave) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  DetectorConfig config;
  config.window_sides = tracking_window_sides(kWidth, kHeight);
  const DeviceFrame frame(*backend, kWidth, kHeight, config, true);
  const TrackerConfig limits;
  const double pixels = limits.most_share * kWidth * kHeight;
  const std::size_t most = frame.most_in_frame(limits.most_windows, pixels);
  EXPECT_LT(3 * most, frame.most_in_frame());
  // Any windows that the tracker may order have room, by the lists that they have.
  const auto slots = [](int side) { return 3 * static_cast<std::size_t>(std::max(64, side * side / 256)); };
  for (const int a : config.window_sides) {
    for (const int b : config.window_sides) {
      const double rest = pixels - static_cast<double>(a) * a - static_cast<double>(b) * b;
      if (rest < 0) continue;
      std::size_t all = slots(a) + slots(b);
      for (const int c : config.window_sides) {
        if (2.0 * c * c <= rest) all = std::max(all, slots(a) + slots(b) + 2 * slots(c));
      }
      EXPECT_GE(most, all) << a << ", " << b;
    }
  }
}

/// Windows of all sides in one frame, with digests and without, on every backend: what is shared is nobody's loss.
TEST(PipelineTracking, SharedMemoryChangesNoBit) {
  DetectorConfig config = posing();
  config.window_sides = {96, 160, 160, 240};
  // Two around markers, one that shows both, one of a corner that is searched last.
  const auto around = [](const Detection& marker) {
    const auto begin = [](double middle, int size) {
      return std::clamp(static_cast<int>(middle) / 8 * 8 - 80, 0, (size - 160) / 8 * 8);
    };
    return SearchWindow{160, begin(marker.center[0], kWidth), begin(marker.center[1], kHeight)};
  };
  const std::unique_ptr<Backend> simd = open_backend("simd");
  Detector detector(*simd, kWidth, kHeight, posing());
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty() || status.name == "reference") continue;
    SCOPED_TRACE(status.name);
    const std::unique_ptr<Backend> backend = open_backend(status.name);
    DeviceFrame apart(*backend, kWidth, kHeight, config, true);
    DeviceFrame shared(*backend, kWidth, kHeight, config, false);
    EXPECT_LT(shared.device_bytes(), apart.device_bytes());
    HostFinish host(kWidth, kHeight, config);
    for (const u64 i : {5, 10, 14}) {
      const std::vector<Detection> markers = detector.detect(picture(i)).detections;
      ASSERT_EQ(markers.size(), 2u);
      const std::vector<SearchWindow> windows = {
          around(markers[0]), {240, 120, 56}, around(markers[1]), {96, 384, 264}};
      std::array<FrameResult, 2> results;
      std::size_t at = 0;
      for (DeviceFrame* frame : {&apart, &shared}) {
        host.reserve(*frame, results[at]);
        frame->submit_windows(picture(i), windows);
        ASSERT_TRUE(frame->finish());
        host.finish(*frame, results[at++]);
      }
      EXPECT_EQ(results[0].quads, results[1].quads);
      EXPECT_GE(results[0].detections.size(), 2u);
      for (std::size_t k = 0; k < results[0].capacities.size(); ++k) {
        EXPECT_EQ(results[0].capacities[k].needed, results[1].capacities[k].needed) << k;
      }
      ASSERT_EQ(results[0].detections.size(), results[1].detections.size());
      for (std::size_t k = 0; k < results[0].detections.size(); ++k) {
        EXPECT_TRUE(test::same_bits(results[0].detections[k], results[1].detections[k]));
      }
    }
  }
}

TEST(PipelineTracking, RefusesMoreInFlightThanItsSlots) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.tracking = tracking(4);
  EXPECT_THAT([&] { Pipeline({backend.get()}, kWidth, kHeight, config); },
              ThrowsMessage<Error>(HasSubstr("4 frames before, in a pipeline of 4 slots")));
  config.tracking = tracking(2);
  config.tracking->same_frame = false;
  EXPECT_THAT([&] { Pipeline({backend.get()}, kWidth, kHeight, config); },
              ThrowsMessage<Error>(HasSubstr("behind is 2")));
}

}  // namespace
}  // namespace berth
