// The frames that wait for a recorder's disk: nothing is lost in silence, and nothing allocated.
#include "frame_queue.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "support/counted_allocations.hpp"
#include "support/handed_frame.hpp"

namespace berth {
namespace {

using cli::FrameQueue;
using cli::QueuedFrame;
using test::HandedFrame;

TEST(FrameQueue, GivesWhatItWasGiven) {
  FrameQueue queue(2, true, 16, 8);
  HandedFrame handed;
  handed.number(5);
  handed.camera = paper_camera();
  queue.push(handed.observed(), 100, false);
  bool closed = true;
  const QueuedFrame* frame = queue.next(std::chrono::milliseconds(0), closed);
  ASSERT_NE(frame, nullptr);
  EXPECT_FALSE(closed);
  EXPECT_EQ(frame->result.stamp.sequence, 5u);
  EXPECT_EQ(frame->result.detections.size(), 2u);
  EXPECT_EQ(frame->came_ns, 100);
  EXPECT_EQ(frame->camera->fx, paper_camera().fx);
  EXPECT_EQ(queue.picture(*frame).at(0, 0), 5);
  EXPECT_EQ(queue.next(std::chrono::milliseconds(0), closed), nullptr);
  EXPECT_FALSE(closed);
  queue.close();
  EXPECT_EQ(queue.next(std::chrono::milliseconds(0), closed), nullptr);
  EXPECT_TRUE(closed);
}

// A disk that does not keep up costs pictures first, then frames; each is counted, and the next one tells of it.
TEST(FrameQueue, DropsAndCountsWhatThereIsNoRoomFor) {
  FrameQueue queue(2, true, 16, 8);
  HandedFrame handed;
  for (u64 i = 0; i < 11; ++i) {
    handed.number(i);
    queue.push(handed.observed(), 0, false);
  }
  EXPECT_EQ(queue.dropped_pictures(), 6u);
  EXPECT_EQ(queue.dropped_frames(), 3u);
  bool closed = false;
  for (u64 i = 0; i < 8; ++i) {
    const QueuedFrame* frame = queue.next(std::chrono::milliseconds(0), closed);
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->result.stamp.sequence, i);
    EXPECT_EQ(frame->picture >= 0, i < 2);
    EXPECT_EQ(frame->missed_frames, 0u);
    if (i != 3) continue;
    // There is room again.
    handed.number(20);
    queue.push(handed.observed(), 0, false);
  }
  const QueuedFrame* frame = queue.next(std::chrono::milliseconds(0), closed);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->result.stamp.sequence, 20u);
  EXPECT_EQ(frame->missed_frames, 3u);
  EXPECT_EQ(queue.picture(*frame).at(0, 0), 20);
  EXPECT_EQ(queue.next(std::chrono::milliseconds(0), closed), nullptr);
}

TEST(FrameQueue, WaitsForRoomWhereItMay) {
  FrameQueue queue(1, true, 16, 8);
  constexpr u64 kFrames = 200;
  std::thread stream([&] {
    HandedFrame handed;
    for (u64 i = 0; i < kFrames; ++i) {
      handed.number(i);
      queue.push(handed.observed(), 0, true);
    }
    queue.close();
  });
  bool closed = false;
  u64 came = 0;
  while (!closed) {
    const QueuedFrame* frame = queue.next(std::chrono::milliseconds(100), closed);
    if (frame == nullptr) continue;
    EXPECT_EQ(frame->result.stamp.sequence, came);
    EXPECT_EQ(queue.picture(*frame).at(0, 0), static_cast<u8>(came));
    ++came;
  }
  stream.join();
  EXPECT_EQ(came, kFrames);
  EXPECT_EQ(queue.dropped_frames() + queue.dropped_pictures(), 0u);
}

TEST(FrameQueue, TakesNoMemoryForAFrame) {
  FrameQueue queue(4, true, 64, 48);
  HandedFrame handed(64, 48);
  handed.label = std::string(60, 'x');
  handed.result.bundles.resize(2);
  bool closed = false;
  const auto once_round = [&] {
    for (int i = 0; i < 40; ++i) {
      queue.push(handed.observed(), 0, false);
      queue.next(std::chrono::milliseconds(0), closed);
    }
  };
  once_round();
  const std::size_t before = test::allocations();
  once_round();
  EXPECT_EQ(test::allocations(), before);
}

}  // namespace
}  // namespace berth
