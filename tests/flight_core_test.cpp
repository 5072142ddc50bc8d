// libberth-core.a: the bits of a Detector, in memory of the caller's and in no other.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "berth/tracker.hpp"
#include "berth_core.h"
#include "sim/scenario.hpp"
#include "support/command_output.hpp"
#include "support/counted_allocations.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using testing::ElementsAreArray;
using testing::HasSubstr;

constexpr double kSide_m = 0.1;
constexpr int kWidth = 640, kHeight = 480;

template <class T>
T empty() {
  T value{};
  value.struct_size = sizeof(T);
  return value;
}

/// Memory for a detector, with a little before and after that nobody may touch.
class Memory {
 public:
  explicit Memory(std::size_t bytes, u8 filled_with = 0xa5)
      : bytes_(bytes), all_(static_cast<u8*>(std::aligned_alloc(BERTH_CORE_ALIGNMENT, rounded(bytes) + 2 * kGuard))) {
    std::memset(all_, filled_with, rounded(bytes) + 2 * kGuard);
    std::memset(all_, kMark, kGuard);
    std::memset(all_ + kGuard + bytes, kMark, kGuard);
  }
  ~Memory() { std::free(all_); }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  u8* get() { return all_ + kGuard; }
  std::size_t bytes() const { return bytes_; }
  bool is_untouched_around() const {
    const auto is_mark = [](u8 byte) { return byte == kMark; };
    return std::all_of(all_, all_ + kGuard, is_mark) &&
           std::all_of(all_ + kGuard + bytes_, all_ + 2 * kGuard + bytes_, is_mark);
  }

 private:
  static constexpr std::size_t kGuard = 256;
  static constexpr u8 kMark = 0x3c;
  static std::size_t rounded(std::size_t bytes) {
    return (bytes + BERTH_CORE_ALIGNMENT - 1) / BERTH_CORE_ALIGNMENT * BERTH_CORE_ALIGNMENT;
  }

  std::size_t bytes_;
  u8* all_;
};

struct Close {
  void operator()(berth_detector* detector) const { berth_detector_close(detector); }
};
using Handle = std::unique_ptr<berth_detector, Close>;

/// Settings for the simulated approach, and what they point to.
struct Settings {
  Settings() : camera(empty<berth_camera>()), core(empty<berth_core_settings>()) {
    EXPECT_EQ(berth_camera_paper(&camera, kWidth, kHeight, nullptr), BERTH_OK);
    core.width = kWidth;
    core.height = kHeight;
    core.camera = &camera;
    core.marker_size_m = kSide_m;
  }
  berth_camera camera;
  berth_core_settings core;
};

DetectorConfig config_like(const Settings& settings) {
  DetectorConfig config;
  config.camera = paper_camera(kWidth, kHeight);
  config.marker_size_m = settings.core.marker_size_m;
  config.corner_method =
      settings.core.corner_method == BERTH_CORNERS_PHOTOMETRIC ? CornerMethod::photometric : CornerMethod::edges;
  return config;
}

std::size_t needed(const Settings& settings) {
  berth_error error{};
  const std::size_t bytes = berth_core_memory_needed(&settings.core, &error);
  EXPECT_GT(bytes, 0U) << error.message;
  return bytes;
}

Handle open(const Settings& settings, Memory& memory) {
  berth_error error{};
  Handle detector(berth_core_open(&settings.core, memory.get(), memory.bytes(), &error));
  EXPECT_NE(detector, nullptr) << error.message;
  return detector;
}

std::vector<SourceFrame> approach(std::size_t count) {
  std::vector<SourceFrame> frames;
  const std::unique_ptr<Source> source = open_scenario(BERTH_SOURCE_DIR "/scenarios/approach.toml");
  while (frames.size() < count) frames.push_back(source->next().value());
  return frames;
}

berth_code detect(berth_detector* detector, const SourceFrame& frame, berth_error* error = nullptr) {
  berth_stamp stamp = empty<berth_stamp>();
  stamp.sequence = frame.stamp.sequence;
  stamp.exposure_start_ns = frame.stamp.exposure_start_ns;
  stamp.mid_exposure_ns = frame.stamp.mid_exposure_ns;
  const View2D<const u8> image = frame.image.view();
  return berth_detector_detect(detector, image.data, static_cast<std::size_t>(image.stride), &stamp, error);
}

void expect_same_pose(const berth_pose_estimate& said, const Pose& pose, const PoseUncertainty& uncertainty) {
  EXPECT_THAT(said.pose.R, ElementsAreArray(pose.R));
  EXPECT_THAT(said.pose.t, ElementsAreArray(pose.t));
  EXPECT_THAT(said.covariance, ElementsAreArray(uncertainty.covariance));
  EXPECT_EQ(said.other_excess, uncertainty.other_excess);
}

/// Returns how many markers there are.
std::size_t expect_same(berth_detector* detector, const FrameResult& result) {
  berth_frame frame = empty<berth_frame>();
  EXPECT_EQ(berth_detector_frame(detector, &frame, nullptr), BERTH_OK);
  EXPECT_EQ(frame.status, static_cast<int>(result.status));
  EXPECT_EQ(frame.markers, result.detections.size());
  for (std::size_t i = 0; i < std::min(frame.markers, result.detections.size()); ++i) {
    const Detection& expected = result.detections[i];
    berth_marker marker = empty<berth_marker>();
    EXPECT_EQ(berth_detector_marker(detector, i, &marker, nullptr), BERTH_OK);
    EXPECT_EQ(marker.family, expected.family->name);
    EXPECT_EQ(marker.id, expected.id);
    for (std::size_t c = 0; c < 4; ++c) EXPECT_THAT(marker.corners[c], ElementsAreArray(expected.corners[c]));
    EXPECT_THAT(marker.corner_covariance, ElementsAreArray(*expected.corner_covariance_px2));
    EXPECT_EQ(marker.has_pose, expected.has_pose ? 1 : 0);
    if (expected.has_pose) expect_same_pose(marker.pose, expected.pose, *expected.pose_uncertainty);
  }
  return frame.markers;
}

void expect_the_detectors_bits(const Settings& settings, const std::vector<SourceFrame>& frames) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector expected(*backend, kWidth, kHeight, config_like(settings));
  Memory memory(needed(settings));
  const Handle detector = open(settings, memory);
  ASSERT_NE(detector, nullptr);
  std::size_t markers = 0;
  for (const SourceFrame& frame : frames) {
    ASSERT_EQ(detect(detector.get(), frame), BERTH_OK);
    markers += expect_same(detector.get(), expected.detect(frame.image.view(), frame.stamp));
  }
  EXPECT_GE(markers, frames.size() / 2);
  EXPECT_TRUE(memory.is_untouched_around());
}

TEST(FlightCore, SaysWhatADetectorSays) { expect_the_detectors_bits(Settings(), approach(4)); }

TEST(FlightCore, SaysWhatADetectorSaysByThePhotometricFit) {
  Settings settings;
  settings.core.corner_method = BERTH_CORNERS_PHOTOMETRIC;
  expect_the_detectors_bits(settings, approach(3));
}

TEST(FlightCore, FollowsMarkersInWindowsAsATrackerDoes) {
  Settings settings;
  settings.core.full_every = 20;
  TrackerConfig tracking;
  tracking.full_every = 20;
  DetectorConfig config = config_like(settings);
  config.window_sides = tracking_window_sides(kWidth, kHeight, tracking);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector expected(*backend, kWidth, kHeight, config);
  Tracker tracker(kWidth, kHeight, tracking);
  Memory memory(needed(settings));
  const Handle detector = open(settings, memory);
  ASSERT_NE(detector, nullptr);
  int windows = 0;
  for (const SourceFrame& frame : approach(10)) {
    ASSERT_EQ(detect(detector.get(), frame), BERTH_OK);
    const TrackedFrame& tracked = tracker.look(expected, frame.image.view(), frame.stamp);
    expect_same(detector.get(), *tracked.result);
    berth_frame said = empty<berth_frame>();
    berth_detector_frame(detector.get(), &said, nullptr);
    EXPECT_EQ(said.whole, tracked.whole ? 1 : 0);
    windows += tracked.whole ? 0 : 1;
  }
  EXPECT_GT(windows, 5);
}

TEST(FlightCore, TakesToTheByteWhatItSaysItNeeds) {
  const Settings settings;
  const std::size_t bytes = needed(settings);
  EXPECT_EQ(needed(settings), bytes);
  Memory memory(bytes);
  EXPECT_NE(open(settings, memory), nullptr);
  berth_error error{};
  EXPECT_EQ(berth_core_open(&settings.core, memory.get(), bytes - 1, &error), nullptr);
  EXPECT_EQ(error.code, BERTH_OUT_OF_MEMORY);
  EXPECT_THAT(error.message, HasSubstr("berth_core_memory_needed"));
  EXPECT_TRUE(memory.is_untouched_around());
}

TEST(FlightCore, AllocatesNothing) {
  Settings settings;
  settings.core.corner_method = BERTH_CORNERS_PHOTOMETRIC;
  const std::vector<SourceFrame> frames = approach(3);
  Memory memory(needed(settings));
  const std::size_t allocations = test::allocations();
  const std::size_t messages = berth_core_message_bytes();
  berth_detector* const detector = berth_core_open(&settings.core, memory.get(), memory.bytes(), nullptr);
  std::size_t failures = 0;
  for (const SourceFrame& frame : frames) failures += detect(detector, frame) == BERTH_OK ? 0 : 1;
  berth_detector_close(detector);
  EXPECT_EQ(test::allocations(), allocations);  // also of the opening
  EXPECT_EQ(berth_core_message_bytes(), messages);
  EXPECT_EQ(failures, 0U);
}

TEST(FlightCore, KeepsNothingInMemoryThatWasGivenBack) {
  const Settings settings;
  const std::size_t bytes = needed(settings);
  const std::vector<SourceFrame> frames = approach(2);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector expected(*backend, kWidth, kHeight, config_like(settings));
  for (const u8 filled_with : {u8{0}, u8{0xff}}) {
    Memory memory(bytes, filled_with);
    Handle detector = open(settings, memory);
    ASSERT_EQ(detect(detector.get(), frames[0]), BERTH_OK);
    detector.reset();
    std::memset(memory.get(), 0xee, bytes);
    const Handle again = open(settings, memory);
    ASSERT_EQ(detect(again.get(), frames[1]), BERTH_OK);
    EXPECT_GT(expect_same(again.get(), expected.detect(frames[1].image.view(), frames[1].stamp)), 0U);
  }
}

TEST(FlightCore, TwoDetectorsHaveNothingInCommon) {
  const Settings settings;
  Memory first_memory(needed(settings)), second_memory(needed(settings));
  Handle first = open(settings, first_memory);
  const Handle second = open(settings, second_memory);
  const std::vector<SourceFrame> frames = approach(2);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector expected(*backend, kWidth, kHeight, config_like(settings));
  ASSERT_EQ(detect(first.get(), frames[0]), BERTH_OK);
  ASSERT_EQ(detect(second.get(), frames[1]), BERTH_OK);
  expect_same(first.get(), expected.detect(frames[0].image.view(), frames[0].stamp));
  first.reset();
  std::memset(first_memory.get(), 0xee, first_memory.bytes());
  expect_same(second.get(), expected.detect(frames[1].image.view(), frames[1].stamp));
}

TEST(FlightCore, FindsBundlesOfEveryFamilyThereIs) {
  Settings settings;
  std::vector<const char*> names;
  for (std::size_t i = 0; berth_family_name(i) != nullptr; ++i) names.push_back(berth_family_name(i));
  ASSERT_GT(names.size(), 10U);
  // Of one family: a frame is searched for outlines or holes by what its families are.
  berth_core_bundle_marker marker{names[0], 1, kSide_m, {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}};
  const berth_core_bundle bundle{"dock", &marker, 1, 0};
  settings.core.bundles = &bundle;
  settings.core.bundle_count = 1;
  for (const char*& name : names) {
    settings.core.families = &name;
    settings.core.family_count = 1;
    marker.family = name;
    Memory memory(needed(settings));
    EXPECT_NE(open(settings, memory), nullptr) << name;
  }
}

TEST(FlightCore, SaysWhatIsWrong) {
  const auto complaint = [](auto change) {
    Settings settings;
    change(settings.core);
    berth_error error{};
    EXPECT_EQ(berth_core_memory_needed(&settings.core, &error), 0U);
    EXPECT_NE(error.code, BERTH_OK);
    return std::string(error.message);
  };
  EXPECT_THAT(complaint([](berth_core_settings& s) { s.width = 0; }), HasSubstr("0x480"));
  EXPECT_THAT(complaint([](berth_core_settings& s) { s.struct_size = 0; }), HasSubstr("struct_size"));
  EXPECT_THAT(complaint([](berth_core_settings& s) { s.corner_method = 9; }), HasSubstr("berth_corner_method"));
  static const char* const kUnknown = "tag36h12";
  EXPECT_THAT(complaint([](berth_core_settings& s) {
                s.families = &kUnknown;
                s.family_count = 1;
              }),
              HasSubstr("tag36h11"));

  const Settings settings;
  Memory memory(needed(settings));
  berth_error error{};
  EXPECT_EQ(berth_core_open(&settings.core, memory.get() + 1, memory.bytes() - 1, &error), nullptr);
  EXPECT_THAT(error.message, HasSubstr("multiple of 64"));
  const Handle detector = open(settings, memory);
  for (int i = 0; i < 50; ++i) {  // more texts than there is room for at a time
    error = {};
    EXPECT_EQ(berth_detector_detect(detector.get(), memory.get(), 3, nullptr, &error), BERTH_BAD_ARGUMENT);
    EXPECT_THAT(error.message, HasSubstr("stride is 3"));
  }
  EXPECT_GT(berth_core_message_bytes(), 0U);
}

TEST(FlightCore, KeepsNamesThroughManyErrorsAndLosesNothingByThem) {
  const std::string name = berth_family_name(0);
  Settings settings;
  const std::size_t bytes = needed(settings);
  static const char* const kUnknown = "a family that nobody has heard of until today";
  Settings wrong;
  wrong.core.families = &kUnknown;
  wrong.core.family_count = 1;
  Memory memory(bytes);
  for (int i = 0; i < 5000; ++i) {  // their texts together are more than the tables have room for
    ASSERT_EQ(berth_core_open(&wrong.core, memory.get(), memory.bytes(), nullptr), nullptr);
  }
  EXPECT_EQ(berth_family_name(0), name);
  const char* const long_name = "tagStandard41h12";
  settings.core.families = &long_name;
  settings.core.family_count = 1;
  Memory enough(needed(settings));
  EXPECT_NE(open(settings, enough), nullptr);
}

TEST(FlightCore, OpensOnSeveralThreads) {
  const Settings settings;
  const std::size_t bytes = needed(settings);
  std::vector<std::unique_ptr<Memory>> memories;
  std::vector<std::thread> threads;
  std::vector<Handle> detectors(4);
  for (std::size_t i = 0; i < detectors.size(); ++i) memories.push_back(std::make_unique<Memory>(bytes));
  for (std::size_t i = 0; i < detectors.size(); ++i) {
    threads.emplace_back([&, i] { detectors[i] = open(settings, *memories[i]); });
  }
  for (std::thread& thread : threads) thread.join();
  const SourceFrame frame = approach(1).front();
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector expected(*backend, kWidth, kHeight, config_like(settings));
  for (const Handle& detector : detectors) {
    ASSERT_EQ(detect(detector.get(), frame), BERTH_OK);
    EXPECT_GT(expect_same(detector.get(), expected.detect(frame.image.view(), frame.stamp)), 0U);
  }
}

TEST(FlightCore, TheExamplePrintsThePose) {
  const SourceFrame frame = approach(1).front();
  const View2D<const u8> image = frame.image.view();
  const test::ScratchFolder folder;
  const std::string pixels(reinterpret_cast<const char*>(image.data), std::size_t{kWidth} * kHeight);
  const auto [text, status] =
      test::output_of(BERTH_CORE_EXAMPLE " " + folder.write("dock.pgm", "P5\n640 480\n255\n" + pixels));
  EXPECT_EQ(status, 0);
  const Settings settings;
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const Detection marker = Detector(*backend, kWidth, kHeight, config_like(settings)).detect(image).detections.at(0);
  char line[100];
  std::snprintf(line, sizeof line, "tag36h11 %d at %.4f %.4f %.4f m\n", marker.id, marker.pose.t[0], marker.pose.t[1],
                marker.pose.t[2]);
  EXPECT_EQ(text.substr(0, text.find(' ')), std::to_string(needed(settings)));
  EXPECT_THAT(text, HasSubstr(line));
}

TEST(FlightCore, ShowsItsFunctionsAndAsksTheSystemForNoMemory) {
  const auto symbols = [](const std::string& which) {
    const auto [text, status] = test::output_of("nm --format=posix " + which + " '" BERTH_CORE_ARCHIVE "'");
    EXPECT_EQ(status, 0);
    std::set<std::string> names;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) names.insert(line.substr(0, line.find(' ')));
    return names;
  };
  for (const std::string& name : symbols("--defined-only --extern-only")) {
    const bool is_members_name = name.find(':') != std::string::npos;
    EXPECT_TRUE(is_members_name || name.compare(0, 6, "berth_") == 0) << name;
  }
  const std::set<std::string> wanted = symbols("--undefined-only");
  EXPECT_EQ(wanted.count("memcpy"), 1U);
  for (const char* name : {"malloc", "calloc", "realloc", "free", "aligned_alloc", "posix_memalign", "sbrk", "fopen",
                           "printf", "_Znwm", "_ZdlPv", "_ZSt4cout"}) {
    EXPECT_EQ(wanted.count(name), 0U) << name;
  }
}

}  // namespace
}  // namespace berth
