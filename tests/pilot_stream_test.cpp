// Both modes at a camera's pace: the network's word counts at a defined frame, and no frame waits for it.
#include "berth/pilot_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>

#include "berth/error.hpp"
#include "pilot/judgement.hpp"
#include "sim/render.hpp"
#include "support/counted_allocations.hpp"
#include "support/faulty_backend.hpp"
#include "support/forwarding_backend.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kWidth = 320, kHeight = 240;
constexpr u64 kFrames = 40;
constexpr int kLook = 3;  // network_frames
const std::string kTiny = std::string(BERTH_SOURCE_DIR) + "/training/tests/data/tiny.berthnet";

/// Nothing, then the marker comes into sight, is away for a while, and comes back.
bool shows_marker(u64 i) { return (i >= 8 && i < 16) || i >= 30; }

View2D<const u8> picture(u64 i) {
  const auto drawn = [](bool with_marker) {
    sim::Scene scene;
    scene.camera = paper_camera(kWidth, kHeight);
    sim::SceneMarker marker;
    marker.size_m = 0.1;
    marker.margin_modules = 1;
    marker.pose.t = {0.02, 0.01, 1};
    if (with_marker) scene.markers.push_back(marker);
    return sim::render(scene);
  };
  static const GrayImage with = drawn(true), without = drawn(false);
  return (shows_marker(i) ? with : without).view();
}

FrameStamp stamp(u64 i) {
  FrameStamp result;
  result.sequence = i;
  return result;
}

PilotStreamConfig config_for(Overrun overrun) {
  PilotStreamConfig config;
  config.pilot.detector.camera = paper_camera(kWidth, kHeight);
  config.pilot.detector.marker_size_m = 0.1;
  config.pilot.navigator.network = kTiny;
  config.pilot.target_in_marker_m = {0, 0, 0.1};
  config.pipeline.overrun = overrun;
  config.network_frames = kLook;
  return config;
}

/// What a frame came to, in a line.
std::string line_of(const PilotFrame& frame, bool is_looked_at) {
  std::string line = std::to_string(frame.stamp.sequence) + " " + name_of(frame.mode) + " " + frame.change;
  if (frame.looked_for_target) {
    line += "; of " + std::to_string(frame.sighting->stamp.sequence) + ": " +
            std::to_string(frame.sighting->score_q15) + (frame.sighting->tracked ? " tracked" : "");
  }
  if (is_looked_at) line += "; looked at";
  if (frame.has_position) {
    line += frame.from_marker ? "; marker" : "; network";
    for (const double value : frame.position_m) {
      u64 bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      line += " " + std::to_string(bits);
    }
  }
  return line;
}

/// The same by one thread: each word is there at once, and kept until its frame comes.
std::vector<std::string> by_hand() {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const PilotConfig config = checked(config_for(Overrun::wait).pilot);
  Detector detector(*backend, kWidth, kHeight, config.detector);
  Navigator navigator(*backend, kWidth, kHeight, config.navigator);
  Judgement judgement(config, kLook);
  bool has_frame = false;
  u64 given = 0;
  Sighting word;
  std::vector<std::string> lines;
  for (u64 i = 0; i < kFrames; ++i) {
    judgement.begin(stamp(i));
    judgement.add(detector.detect(picture(i), stamp(i)));
    if (has_frame && i == given + kLook) {
      judgement.add(word);
      has_frame = false;
    }
    const PilotFrame& frame = judgement.conclude();
    const bool looks = !has_frame && (frame.mode != Mode::docking || frame.marker == nullptr);
    lines.push_back(line_of(frame, looks));
    if (!looks) continue;
    if (const auto at = judgement.take_expectation()) navigator.expect(at->x_px, at->y_px, at->d_px);
    word = navigator.look(picture(i), stamp(i));
    given = i;
    has_frame = true;
  }
  return lines;
}

TEST(PilotStream, ModesAndPositionsDependOnTheFramesAlone) {
  const std::vector<std::string> wanted = by_hand();
  const std::unique_ptr<Backend> simd = open_backend("simd"), cpu = open_backend("cpu");
  for (Backend* navigation : {simd.get(), cpu.get()}) {
    std::vector<std::string> found;
    PilotStream stream({simd.get()}, *navigation, kWidth, kHeight, config_for(Overrun::wait),
                       [&](const PilotStreamFrame& frame) {
                         found.push_back(line_of(*frame.pilot, frame.is_looked_at));
                         EXPECT_EQ(frame.late_by, 0);
                         EXPECT_EQ(frame.pilot->markers, frame.frame->result);
                       });
    for (int round = 0; round < 2; ++round) {  // started again, it knows nothing
      found.clear();
      stream.start();
      for (u64 i = 0; i < kFrames; ++i) EXPECT_TRUE(stream.push(picture(i), stamp(i)));
      stream.stop();
      EXPECT_EQ(found, wanted) << navigation->name();
      const PilotStreamCounts counts = stream.counts();
      EXPECT_GE(counts.looks, 5u);
      EXPECT_EQ(counts.late_looks + counts.lost_looks, 0u);
      EXPECT_EQ(counts.alone.frames + counts.beside_network.frames, kFrames);
    }
  }
  const auto docked = [](const std::string& line) { return line.find("docking") != std::string::npos; };
  EXPECT_TRUE(docked(wanted[10]) && !docked(wanted[9])) << "read in three frames running";
  EXPECT_TRUE(docked(wanted[19])) << "held on to for five";
  EXPECT_FALSE(docked(wanted[20]));
  EXPECT_THAT(wanted[16], HasSubstr("looked at")) << "the network helps out at once";
}

/// A backend whose network does not come back until it is let.
struct Gate {
  std::mutex mutex;
  std::condition_variable moved;
  bool is_shut = false;
  void set(bool shut) {
    const std::lock_guard<std::mutex> lock(mutex);
    is_shut = shut;
    moved.notify_all();
  }
};

class GatedStream final : public test::ForwardingStream {
 public:
  GatedStream(std::unique_ptr<Stream> behind, Gate& gate) : ForwardingStream(std::move(behind)), gate_(gate) {}
  void replay(Plan& plan) override {
    std::unique_lock<std::mutex> lock(gate_.mutex);
    gate_.moved.wait(lock, [this] { return !gate_.is_shut; });
    lock.unlock();
    behind().replay(plan);
  }

 private:
  Gate& gate_;
};

TEST(PilotStream, NoFrameWaitsForTheNetworkAndItsLateWordIsCounted) {
  Gate gate;
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::ForwardingBackend slow("gated", *simd, [&](std::unique_ptr<Stream> behind) {
    return std::make_unique<GatedStream>(std::move(behind), gate);
  });
  PilotStreamConfig config = config_for(Overrun::newest);
  config.pipeline.deadlines_ns = {1, 1'000'000'000'000};
  std::mutex mutex;
  std::condition_variable moved;
  u64 delivered = 0;
  std::vector<std::pair<u64, int>> words;  // the frame at which one came, and how late
  PilotStream stream({simd.get()}, slow, kWidth, kHeight, config, [&](const PilotStreamFrame& frame) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (frame.pilot->looked_for_target) words.emplace_back(delivered, frame.late_by);
    ++delivered;
    moved.notify_all();
  });
  stream.start();
  gate.set(true);
  u64 pushed = 0;
  const auto fly = [&](u64 frames) {
    for (u64 i = 0; i < frames; ++i) {
      EXPECT_TRUE(stream.push(picture(8), stamp(pushed++)));
      std::unique_lock<std::mutex> lock(mutex);
      moved.wait(lock, [&] { return delivered == pushed; });  // would hang if it waited for the network
    }
  };
  fly(2 * kLook + 1);
  EXPECT_TRUE(words.empty());
  gate.set(false);
  // Docked, it is asked no more; its word comes at a multiple of three frames after the first.
  while (words.empty()) fly(1);
  stream.stop();
  ASSERT_EQ(words.size(), 1u);
  EXPECT_EQ(words[0].first % kLook, 0u);
  EXPECT_EQ(words[0].second, static_cast<int>(words[0].first / kLook) - 1);
  EXPECT_GE(words[0].second, 2);
  const PilotStreamCounts counts = stream.counts();
  EXPECT_EQ(counts.looks, 1u);
  EXPECT_EQ(counts.late_looks, 1u);
  EXPECT_GE(counts.beside_network.frames, 2u * kLook);
  EXPECT_EQ(counts.beside_network.late[0], counts.beside_network.frames) << "1 ns is too short for all";
  EXPECT_EQ(counts.beside_network.late[1] + counts.alone.late[1], 0u);
  EXPECT_EQ(stream.pipeline().counts().all_dropped(), 0u);
}

TEST(PilotStream, ANetworkWhoseDeviceIsLostStopsNothingElse) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::Fault fault;
  fault.lose_frame = 2;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  Mode last = Mode::search;
  u64 statuses = 0;
  PilotStream stream({simd.get()}, *faulty, kWidth, kHeight, config_for(Overrun::wait),
                     [&](const PilotStreamFrame& frame) {
                       last = frame.pilot->mode;
                       statuses += frame.pilot->status == FrameStatus::device_lost ? 1 : 0;
                     });
  stream.start();
  for (u64 i = 0; i < kFrames; ++i) stream.push(picture(i), stamp(i));
  stream.stop();
  EXPECT_EQ(last, Mode::docking);
  EXPECT_EQ(stream.counts().lost_looks, 1u);
  EXPECT_EQ(statuses, 0u);
  EXPECT_EQ(stream.pipeline().counts().delivered, kFrames);
}

TEST(PilotStream, NothingIsAllocatedOnceStarted) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  std::array<u64, 3> modes = {};
  PilotStream stream({simd.get()}, *simd, kWidth, kHeight, config_for(Overrun::wait),
                     [&](const PilotStreamFrame& frame) { ++modes[static_cast<std::size_t>(frame.pilot->mode)]; });
  picture(0);
  stream.start();
  const std::size_t started = test::allocations();
  for (u64 i = 0; i < 3 * kFrames; ++i) stream.push(picture(i % kFrames), stamp(i));
  stream.close();
  while (stream.pipeline().counts().delivered < 3 * kFrames) std::this_thread::yield();
  EXPECT_EQ(test::allocations(), started);
  stream.stop();
  EXPECT_GT(modes[static_cast<std::size_t>(Mode::docking)], 10u);
  EXPECT_LT(modes[static_cast<std::size_t>(Mode::docking)], 3 * kFrames - 10);
}

TEST(PilotStream, WhatACallbackThrowsComesOutOfStopAndBadConfigurationsAreRefused) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  PilotStreamConfig config = config_for(Overrun::wait);
  PilotStream stream({simd.get()}, *simd, kWidth, kHeight, config,
                     [](const PilotStreamFrame&) { throw std::runtime_error("the log is full"); });
  stream.start();
  for (u64 i = 0; stream.push(picture(i), stamp(i));) ++i;
  EXPECT_THAT([&] { stream.stop(); }, ThrowsMessage<std::runtime_error>(HasSubstr("the log is full")));
  const auto make = [&](const PilotStream::Deliver& deliver) {
    PilotStream({simd.get()}, *simd, kWidth, kHeight, config, deliver);
  };
  EXPECT_THAT([&] { make({}); }, ThrowsMessage<Error>(HasSubstr("callback")));
  config.network_frames = 0;
  EXPECT_THAT([&] { make([](const PilotStreamFrame&) {}); }, ThrowsMessage<Error>(HasSubstr("network_frames is 0")));
}

}  // namespace
}  // namespace berth
