// Who has which slot, by one thread that plays all parts; the threads themselves are in pipeline_test.
#include "pipeline/slot_ring.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace berth {
namespace {

int offer(SlotRing& ring) {
  const int slot = ring.begin();
  EXPECT_TRUE(ring.commit());
  return slot;
}

int take(SlotRing& ring) {
  bool again = false;
  const int slot = ring.take(again);
  EXPECT_FALSE(again);
  return slot;
}

/// From the camera to the device.
int put_on_device(SlotRing& ring) {
  offer(ring);
  const int slot = take(ring);
  ring.on_device(slot);
  return slot;
}

u64 dropped(const SlotRing& ring, DropCause cause) { return ring.counts().dropped[static_cast<std::size_t>(cause)]; }

TEST(SlotRing, AFrameGoesRound) {
  SlotRing ring(2, Overrun::newest);
  for (int i = 0; i < 5; ++i) {
    const int slot = put_on_device(ring);
    EXPECT_EQ(ring.await(), slot);
    ring.on_host();
    ring.done(slot, false);
  }
  EXPECT_EQ(ring.counts().offered, 5u);
  EXPECT_EQ(ring.counts().delivered, 5u);
  EXPECT_EQ(ring.counts().all_dropped(), 0u);
}

TEST(SlotRing, TheNewestReplacesTheOneThatWaits) {
  SlotRing ring(4, Overrun::newest);
  offer(ring);
  take(ring);  // the device is at work from here on
  offer(ring);
  const int newer = offer(ring);
  const int newest = offer(ring);
  EXPECT_NE(newer, newest);
  EXPECT_EQ(dropped(ring, DropCause::device), 2u);
  EXPECT_EQ(ring.counts().offered, 4u);
  ring.on_device(0);
  EXPECT_EQ(take(ring), newest);
}

TEST(SlotRing, ThereIsAlwaysASlotForTheNewest) {
  for (int slots = 2; slots <= 5; ++slots) {
    SlotRing ring(slots, Overrun::newest);
    for (int i = 0; i + 1 < slots; ++i) put_on_device(ring);
    for (int i = 0; i < 3; ++i) offer(ring);  // would wait for ever, or find none
    EXPECT_EQ(ring.counts().all_dropped(), 2u) << slots;
  }
}

TEST(SlotRing, TellsWhatADroppedFrameWaitedFor) {
  SlotRing ring(3, Overrun::newest);
  put_on_device(ring);
  put_on_device(ring);
  const int oldest = ring.await();
  offer(ring);
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::device), 1u) << "all slots taken, the oldest still on the device";
  ring.on_host();
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::host), 1u);
  ring.delivering();
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::reader), 1u);
  ring.done(oldest, true);
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::reader), 2u) << "delivered, but not fetched";
  EXPECT_EQ(ring.fetch(false), oldest);
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::reader), 3u) << "the reader has it still";
  EXPECT_EQ(ring.fetch(false), -1);
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::device), 2u) << "the device could have taken the one that waited";
}

TEST(SlotRing, BeganButNotCommittedIsGivenAgain) {
  SlotRing ring(2, Overrun::newest);
  const int slot = ring.begin();
  EXPECT_EQ(ring.begin(), slot);
  EXPECT_TRUE(ring.commit());
  EXPECT_EQ(ring.counts().offered, 1u);
}

TEST(SlotRing, ClosedItTakesNoMoreAndEndsWhenAllIsThrough) {
  SlotRing ring(3, Overrun::newest);
  const int first = put_on_device(ring);
  const int second = offer(ring);
  EXPECT_GE(ring.begin(), 0);
  ring.close();
  EXPECT_FALSE(ring.commit());
  EXPECT_EQ(ring.begin(), -1);
  EXPECT_EQ(take(ring), second);
  ring.on_device(second);
  for (const int slot : {first, second}) {
    EXPECT_EQ(ring.await(), slot);
    ring.done(slot, true);
  }
  EXPECT_EQ(take(ring), -1);
  EXPECT_EQ(ring.await(), -1);
  EXPECT_EQ(ring.fetch(true), first);
  ring.discard();
  EXPECT_EQ(ring.fetch(true), -1);
  const PipelineCounts counts = ring.counts();
  EXPECT_EQ(counts.offered, 2u);
  EXPECT_EQ(counts.delivered, 1u);
  EXPECT_EQ(dropped(ring, DropCause::reader), 1u);
  ring.reopen();
  EXPECT_EQ(ring.counts().offered, 0u);
  for (int i = 0; i < 6; ++i) {
    const int slot = put_on_device(ring);
    EXPECT_EQ(ring.await(), slot);
    ring.done(slot, false);
  }
}

TEST(SlotRing, RunAgainComesBeforeTheOnesThatWaitAndKeepsItsPlace) {
  SlotRing ring(4, Overrun::newest);
  const int first = put_on_device(ring);
  const int second = put_on_device(ring);
  offer(ring);
  EXPECT_EQ(ring.await(), first);
  std::thread device([&] {
    bool again = false;
    int slot = ring.take(again);
    if (!again) {  // the one that waits came first: then the lost one is next
      ring.on_device(slot);
      slot = ring.take(again);
    }
    EXPECT_TRUE(again);
    EXPECT_EQ(slot, first);
    ring.on_device(slot);
  });
  ring.run_again(first);
  device.join();
  EXPECT_EQ(ring.await(), first);
  ring.done(first, false);
  EXPECT_EQ(ring.await(), second);
}

TEST(SlotRing, TheDeviceWaitsForResultsThatItMayGoBy) {
  SlotRing ring(5, Overrun::newest, 2);
  const int first = put_on_device(ring);
  put_on_device(ring);
  offer(ring);
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::device), 1u) << "two are in flight, slots or not";
  EXPECT_EQ(ring.await(), first);
  ring.on_host();
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::host), 1u);
  ring.settled();
  const int third = take(ring);  // while the first is still being delivered
  ring.on_device(third);
  ring.delivering();
  offer(ring);
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::reader), 1u) << "the callback holds up the second's result";
  ring.done(first, true);
  EXPECT_NE(ring.await(), first);
  ring.on_host();
  offer(ring);
  EXPECT_EQ(dropped(ring, DropCause::host), 2u) << "fetching the first would not help";
}

TEST(SlotRing, WhereNoFrameMayBeLostTheCameraWaits) {
  SlotRing ring(2, Overrun::wait);
  const int first = offer(ring);
  const int second = offer(ring);
  EXPECT_EQ(take(ring), first);
  ring.on_device(first);
  int third = -1;
  std::thread camera([&] { third = offer(ring); });
  EXPECT_EQ(ring.await(), first);
  ring.done(first, false);
  camera.join();
  EXPECT_EQ(third, first);
  EXPECT_EQ(take(ring), second);
  EXPECT_EQ(ring.counts().all_dropped(), 0u);
  std::thread blocked([&] { EXPECT_EQ(ring.begin(), -1); });
  ring.close();
  blocked.join();
}

}  // namespace
}  // namespace berth
