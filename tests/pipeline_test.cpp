// What a pipeline makes of frames is what a Detector makes of them, whatever its slots, threads and drops.
#include "berth/pipeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "berth/error.hpp"
#include "support/counted_allocations.hpp"
#include "support/pipeline_frames.hpp"

namespace berth {
namespace {

using namespace test::pipeline;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(Pipeline, GivesTheDetectorsBitsOnEveryBackendWithAnySlots) {
  PipelineConfig config;
  config.detector = posing();
  config.detector.digests = true;
  config.overrun = Overrun::wait;
  Judge judge(config.detector);
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty() || status.name == "reference") continue;
    SCOPED_TRACE(status.name);
    BackendOptions options;
    options.threads = 2;
    const std::unique_ptr<Backend> backend = open_backend(status.name, options);
    for (const int slots : {2, 3, 5}) {
      config.slots = slots;
      Judge fresh = judge;
      Pipeline pipeline({backend.get()}, kWidth, kHeight, config, std::ref(fresh));
      pipeline.start();
      for (u64 i = 0; i < 2 * kPictures; ++i) ASSERT_TRUE(pipeline.push(picture(i), stamped(i)));
      pipeline.stop();
      EXPECT_EQ(fresh.seen(), 2 * kPictures) << slots;
      EXPECT_EQ(pipeline.counts().delivered, 2 * kPictures);
      EXPECT_EQ(pipeline.counts().all_dropped(), 0u);
      EXPECT_EQ(pipeline.times(Lap::latency).count(), 2 * kPictures);
    }
  }
}

TEST(Pipeline, WhenTheReaderIsSlowTheNewestFrameWinsAndDropsAreCounted) {
  PipelineConfig config;
  config.detector = posing();
  Judge judge(config.detector);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  std::mutex mutex;
  std::condition_variable moved;
  bool open = false;
  u64 held = 0;
  std::vector<u64> delivered;
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
    judge(frame);
    std::unique_lock<std::mutex> lock(mutex);
    delivered.push_back(frame.result->stamp.sequence);
    ++held;
    moved.notify_all();
    moved.wait(lock, [&] { return open; });
  });
  pipeline.start();
  pipeline.push(picture(0), stamped(0));
  {
    std::unique_lock<std::mutex> lock(mutex);
    moved.wait(lock, [&] { return held == 1; });
  }
  const auto by_reader = [&] { return pipeline.counts().dropped[static_cast<std::size_t>(DropCause::reader)]; };
  u64 last = 0;
  do {
    ++last;
    pipeline.push(picture(last), stamped(last));
  } while (by_reader() == 0);  // until the device has done all that it may
  {
    const std::lock_guard<std::mutex> lock(mutex);
    open = true;
    moved.notify_all();
  }
  pipeline.stop();
  // The first is with the callback, two more are past waiting at most, and the last one waits.
  const PipelineCounts counts = pipeline.counts();
  EXPECT_EQ(counts.offered, last + 1);
  EXPECT_LE(delivered.size(), 4u);
  EXPECT_EQ(delivered.back(), last);
  EXPECT_EQ(counts.delivered, delivered.size());
  EXPECT_EQ(counts.delivered + counts.all_dropped(), counts.offered);
  EXPECT_EQ(by_reader(), 1u);
}

TEST(Pipeline, ResultsCanBeFetchedInsteadOfDelivered) {
  PipelineConfig config;
  config.detector = posing();
  config.overrun = Overrun::wait;
  Judge judge(config.detector);
  const std::unique_ptr<Backend> backend = open_backend("cpu");
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config);
  pipeline.start();
  EXPECT_EQ(pipeline.poll(), nullptr);
  std::thread camera([&] {
    for (u64 i = 0; i < 20; ++i) pipeline.push(picture(i), stamped(i));
    pipeline.close();
  });
  while (const PipelineFrame* frame = pipeline.next()) judge(*frame);
  camera.join();
  EXPECT_EQ(judge.seen(), 20u);
  EXPECT_FALSE(pipeline.push(picture(0), stamped(20)));
  pipeline.stop();
}

TEST(Pipeline, ResultsThatNobodyFetchesAreDropsToo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Pipeline pipeline({backend.get()}, kWidth, kHeight, {});
  for (int round = 0; round < 2; ++round) {  // it can be started again
    pipeline.start();
    EXPECT_THROW(pipeline.start(), Error);
    for (u64 i = 0; i < 10; ++i) pipeline.push(picture(i), stamped(i));
    ASSERT_NE(pipeline.next(), nullptr);
    pipeline.stop();
    const PipelineCounts counts = pipeline.counts();
    EXPECT_EQ(counts.offered, 10u);
    EXPECT_EQ(counts.delivered, 1u);
    EXPECT_EQ(counts.all_dropped(), 9u);
  }
}

TEST(Pipeline, PixelsMayBeWrittenStraightIntoASlot) {
  PipelineConfig config;
  config.detector = posing();
  config.overrun = Overrun::wait;
  Judge judge(config.detector);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  std::vector<u64> beside(static_cast<std::size_t>(config.slots));
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
    EXPECT_EQ(beside[static_cast<std::size_t>(frame.slot)], frame.result->stamp.sequence);
    judge(frame);
  });
  pipeline.start();
  for (u64 i = 0; i < 30; ++i) {
    const FrameSlot slot = pipeline.begin();
    for (int y = 0; y < kHeight; ++y) std::copy_n(picture(i).row(y), kWidth, slot.image.row(y));
    beside[static_cast<std::size_t>(slot.slot)] = i;
    pipeline.commit(stamped(i));
  }
  pipeline.stop();
  EXPECT_EQ(judge.seen(), 30u);
}

TEST(Pipeline, ACallbackClosesItButCannotStopIt) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.overrun = Overrun::wait;
  int refused = 0;
  Pipeline* itself = nullptr;
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config, [&](const PipelineFrame&) {
    EXPECT_THAT([&] { itself->stop(); }, ThrowsMessage<Error>(HasSubstr("close()")));
    ++refused;
    itself->close();
  });
  itself = &pipeline;
  pipeline.start();
  u64 taken = 0;
  while (pipeline.push(picture(taken), stamped(taken))) ++taken;
  pipeline.stop();
  EXPECT_GE(refused, 1);
  EXPECT_EQ(pipeline.counts().offered, taken);
  EXPECT_EQ(pipeline.counts().delivered, taken);
}

TEST(Pipeline, TakesFramesBetweenStartAndStopOnly) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.overrun = Overrun::wait;
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config);
  EXPECT_FALSE(pipeline.push(picture(0), stamped(0)));
  EXPECT_EQ(pipeline.begin().image.data, nullptr);
  EXPECT_EQ(pipeline.next(), nullptr);
  pipeline.close();
  EXPECT_EQ(pipeline.next(), nullptr);
  for (u64 round = 0; round < 2; ++round) {
    EXPECT_FALSE(pipeline.push(picture(0), stamped(0)));
    pipeline.stop();
    EXPECT_FALSE(pipeline.push(picture(0), stamped(0)));
    EXPECT_EQ(pipeline.counts().offered, round);
    pipeline.start();
    EXPECT_TRUE(pipeline.push(picture(1), stamped(1)));
    const PipelineFrame* frame = pipeline.next();
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->result->stamp.sequence, 1u);
    EXPECT_EQ(pipeline.counts().offered, 1u);
    EXPECT_EQ(pipeline.counts().delivered, 1u);
    pipeline.stop();
  }
}

TEST(Pipeline, SaysSoWhenAFrameWasNotTaken) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Pipeline pipeline({backend.get()}, kWidth, kHeight, {}, [](const PipelineFrame&) {});
  pipeline.start();
  ASSERT_NE(pipeline.begin().image.data, nullptr);
  pipeline.close();
  EXPECT_FALSE(pipeline.commit(stamped(0)));
  EXPECT_FALSE(pipeline.commit(stamped(0)));  // nor what was not begun
  pipeline.stop();
  EXPECT_EQ(pipeline.counts().offered, 0u);
  // The camera spends most of its time between begin and commit: some of these ends fall there.
  for (int round = 0; round < 20; ++round) {
    pipeline.start();
    std::atomic<u64> taken = 0;
    std::thread camera([&] {
      while (pipeline.push(picture(taken), stamped(taken))) ++taken;
    });
    while (taken < 3) std::this_thread::yield();
    pipeline.stop();
    camera.join();
    EXPECT_EQ(pipeline.counts().offered, taken);
  }
}

struct Load {
  const char* backend;
  Overrun overrun;
  CornerMethod corners;
  u64 frames;
};

class PipelineAllocations : public testing::TestWithParam<Load> {};

TEST_P(PipelineAllocations, IsNotAllocatedOnceStarted) {
  const Load& load = GetParam();
  PipelineConfig config;
  config.detector = posing();
  config.detector.corner_method = load.corners;
  config.overrun = load.overrun;
  const std::unique_ptr<Backend> backend = open_backend(load.backend);
  u64 markers = 0;
  ASSERT_EQ(frames().size(), kPictures);  // drawn by now
  const std::size_t at_first = test::allocations();
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config,
                    [&](const PipelineFrame& frame) { markers += frame.result->detections.size(); });
  pipeline.start();
  const std::size_t started = test::allocations();
  EXPECT_GT(started, at_first);
  for (u64 i = 0; i < load.frames; ++i) pipeline.push(picture(i), stamped(i));
  pipeline.close();
  PipelineCounts counts = pipeline.counts();
  for (; counts.delivered + counts.all_dropped() < load.frames; counts = pipeline.counts()) std::this_thread::yield();
  EXPECT_EQ(test::allocations(), started);
  pipeline.stop();
  EXPECT_TRUE(markers > 0 || load.overrun == Overrun::newest);
}

INSTANTIATE_TEST_SUITE_P(Loads, PipelineAllocations,
                         testing::Values(Load{"simd", Overrun::wait, CornerMethod::edges, 2000},
                                         Load{"simd", Overrun::newest, CornerMethod::edges, 4000},
                                         Load{"simd", Overrun::wait, CornerMethod::photometric, 60},
                                         Load{"cpu", Overrun::wait, CornerMethod::edges, 30}));

TEST(Pipeline, LatencyCountsFromTheCamerasTimeAndLateFramesAreCounted) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.overrun = Overrun::wait;
  config.deadlines_ns = {1, std::int64_t{3600} * 1000000000};
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config, [](const PipelineFrame&) {});
  pipeline.start();
  FrameStamp stamp = stamped(0);
  stamp.clock = "monotonic";
  constexpr std::int64_t kTwoHours = std::int64_t{7200} * 1000000000;
  stamp.mid_exposure_ns =
      std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count() - kTwoHours;
  pipeline.push(picture(0), stamp);
  for (u64 i = 1; i < 5; ++i) pipeline.push(picture(i), stamped(i));
  pipeline.stop();
  EXPECT_GE(pipeline.times(Lap::latency).max(), kTwoHours);
  EXPECT_EQ(pipeline.counts().late[0], 5u);
  EXPECT_EQ(pipeline.counts().late[1], 1u);
}

TEST(Pipeline, StatesItsMemory) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  const Detector detector(*backend, kWidth, kHeight, config.detector);
  for (const int slots : {2, 7}) {
    config.slots = slots;
    const Pipeline pipeline({backend.get()}, kWidth, kHeight, config);
    EXPECT_EQ(pipeline.memory().slots, slots);
    EXPECT_EQ(pipeline.memory().device_bytes, static_cast<std::size_t>(slots) * detector.device_bytes());
    EXPECT_GT(pipeline.memory().host_bytes, static_cast<std::size_t>(slots) * sizeof(Detection));
  }
}

TEST(Pipeline, RefusesWhatItCannotDo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const auto make = [&](const PipelineConfig& config) { Pipeline({backend.get()}, kWidth, kHeight, config); };
  EXPECT_THAT([] { Pipeline({}, kWidth, kHeight, {}); }, ThrowsMessage<Error>(HasSubstr("at least one")));
  PipelineConfig one;
  one.slots = 1;
  EXPECT_THAT([&] { make(one); }, ThrowsMessage<Error>(HasSubstr("1 slots")));
  PipelineConfig hasty;
  hasty.deadlines_ns[1] = 0;
  EXPECT_THAT([&] { make(hasty); }, ThrowsMessage<Error>(HasSubstr("deadline")));
  PipelineConfig urgent;
  urgent.realtime_priority = 100;
  EXPECT_THAT([&] { make(urgent); }, ThrowsMessage<Error>(HasSubstr("1 to 99")));
  PipelineConfig wide;
  wide.cores = {0, 1, 2};
  EXPECT_THAT([&] { make(wide); }, ThrowsMessage<Error>(HasSubstr("two")));
  PipelineConfig far;
  far.cores = {100000};
  Pipeline pinned({backend.get()}, kWidth, kHeight, far);
  EXPECT_THAT([&] { pinned.start(); }, ThrowsMessage<Error>(HasSubstr("core 100000 does not exist")));
  Pipeline pipeline({backend.get()}, kWidth, kHeight, {});
  EXPECT_THAT([&] { pipeline.push(pictures::uniform(64, 48, 9).view(), {}); },
              ThrowsMessage<Error>(HasSubstr("64x48")));
}

TEST(Pipeline, RealTimePriorityIsHadOrTheRemedyNamed) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.realtime_priority = 5;
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config);
  try {
    pipeline.start();
    EXPECT_TRUE(pipeline.push(picture(0), {}));
    EXPECT_NE(pipeline.next(), nullptr);
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("ulimit -r"));
  }
}

}  // namespace
}  // namespace berth
