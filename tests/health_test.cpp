// What a backend that computes something else, or memory that was altered, comes to: seen, left, no frame lost.
#include "berth/health.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "berth/failover.hpp"
#include "frame/marker_plan.hpp"
#include "health/health_watch.hpp"
#include "support/counted_allocations.hpp"
#include "support/faulty_backend.hpp"
#include "support/pipeline_frames.hpp"

namespace berth {
namespace {

using namespace test::pipeline;

/// Asked before every frame.
HealthConfig always() {
  HealthConfig health;
  health.known_answer_every_ns = 1;
  return health;
}

/// How many run ends there were, which the host reads, turns a bit over in one replay.
test::Fault wrong_count(int replay) {
  const std::unique_ptr<Backend> backend = open_backend("cpu");
  const MarkerPlan plan(*backend, kWidth, kHeight, {});
  test::Fault fault;
  for (std::size_t i = 0; i < plan.steps().size(); ++i) {
    if (plan.steps()[i].op == Op::contour_collect && fault.flip_step < 0) fault.flip_step = static_cast<int>(i);
  }
  fault.flip_argument = 2;
  fault.flip_frame = replay;
  return fault;
}

TEST(KnownAnswer, IsTheSameOnEveryBackendAndAsItWas) {
  const KnownAnswer known(640, 480, {});
  // What the reference made of it when this was written: the picture is src/health/known_answer.cpp's.
  EXPECT_EQ(known.expected(), 7805734450861871740u);
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty()) continue;
    const std::unique_ptr<Backend> backend = open_backend(status.name);
    Detector detector(*backend, 640, 480, {});
    const FrameResult& result = detector.detect(known.image());
    EXPECT_TRUE(known.fits(result)) << status.name;
    EXPECT_GT(result.detections.size(), 20u);
  }
}

TEST(KnownAnswer, ShowsEveryFamilyThatFits) {
  DetectorConfig config;
  config.families = {"tag36h11", "tagStandard41h12", "aruco4x4_50"};
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector detector(*backend, 640, 480, config);
  std::vector<std::string> seen;
  for (const Detection& d : detector.detect(known_picture(640, 480, config.families).view()).detections) {
    seen.push_back(d.family->name);
  }
  EXPECT_THAT(seen, testing::IsSupersetOf(config.families));
}

TEST(MemoryScrub, FindsABitWhereverItTurns) {
  std::vector<u32> first(3000, 7), second(5, 9);
  std::vector<ConstantMemory> blocks;
  add_constants("first", first, blocks);
  add_constants("second", second, blocks);
  MemoryScrub scrub;
  scrub.add(blocks, 4);
  EXPECT_EQ(scrub.bytes(), 12020u);
  EXPECT_FALSE(scrub.check(20000));
  for (u32* word : {&first.front(), &first[1500], &first.back(), &second.back()}) {
    *word ^= 1u << 13;
    const auto found = scrub.check(scrub.bytes());
    ASSERT_TRUE(found);
    EXPECT_STREQ(found->what, word == &second.back() ? "second" : "first");
    EXPECT_EQ(found->owner, 4);
    *word ^= 1u << 13;
    EXPECT_FALSE(scrub.check(scrub.bytes()));
  }
  // A slice at a time: the bit is behind the first.
  first.back() ^= 1;
  int slices = 1;
  while (!scrub.check(4096)) ++slices;
  EXPECT_LE(slices, 4);
}

TEST(MemoryScrub, KnowsTheProgram) {
  std::size_t bytes = 0;
  for (const ConstantMemory& block : program_memory()) bytes += block.bytes;
#ifdef __linux__
  EXPECT_GT(bytes, 100000u);
#else
  EXPECT_EQ(bytes, 0u);
#endif
}

TEST(HealthWatch, LeavesTheBackendWhoseMemoryWasAltered) {
  std::vector<u32> first(100, 1), second(100, 2);
  HealthWatch watch(always(), kWidth, kHeight, {}, 2);
  std::vector<ConstantMemory> blocks;
  add_constants("code book", first, blocks);
  watch.watch(blocks, 0);
  blocks.clear();
  add_constants("code book", second, blocks);
  watch.watch(blocks, 1);
  const auto around = [&] {
    const u64 until = watch.report().checked_bytes + watch.report().watched_bytes + 20000;
    while (watch.report().checked_bytes < until) watch.scrub();
  };
  around();
  EXPECT_EQ(watch.report().mode, HealthMode::nominal);
  first[50] ^= 1u << 30;
  around();
  EXPECT_EQ(watch.report().mode, HealthMode::fallback);
  EXPECT_STREQ(watch.report().reason, "code book");
  EXPECT_EQ(watch.active(), 1u);
  second[99] ^= 1;
  around();
  EXPECT_EQ(watch.report().mode, HealthMode::failed);
  EXPECT_TRUE(watch.has_failed());
}

TEST(Detector, ListsTheMemoryThatNoFrameWrites) {
  for (const char* name : {"cpu", "simd"}) {
    const std::unique_ptr<Backend> backend = open_backend(name);
    DetectorConfig config = posing();
    config.flat_field.assign(std::size_t{kWidth} * kHeight, 1.0F);
    Detector detector(*backend, kWidth, kHeight, config);
    std::vector<ConstantMemory> memory;
    detector.list_constants(memory);
    std::vector<std::string> names;
    for (const ConstantMemory& block : memory) names.emplace_back(block.what);
    EXPECT_THAT(names, testing::IsSupersetOf({"code book", "layout", "configuration", "family", "launch list",
                                              "kernel parameters", "flat field"}));
    MemoryScrub scrub;
    scrub.add(memory, 0);
    for (u64 i = 0; i < kPictures; ++i) detector.detect(picture(i));
    EXPECT_FALSE(scrub.check(scrub.bytes()));
  }
}

TEST(Failover, LeavesABackendThatAnswersWrongly) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const std::unique_ptr<Backend> cpu = open_backend("cpu");
  // The picture at start, then the picture and the frame in turn.
  const auto faulty = test::make_faulty_backend(*simd, wrong_count(3));
  FailoverDetector detector({faulty.get(), cpu.get()}, kWidth, kHeight, posing(), always());
  const std::vector<FrameResult> wanted = expected(posing());
  for (u64 i = 0; i < kPictures; ++i) {
    const FrameResult& result = detector.detect(picture(i), stamped(i));
    EXPECT_EQ(result.stamp.sequence, i);
    expect_same(result, wanted[i]);
    EXPECT_EQ(detector.active(), i < 1 ? 0u : 1u);
    EXPECT_EQ(detector.health().mode, i < 1 ? HealthMode::nominal : HealthMode::fallback);
  }
  EXPECT_STREQ(detector.health().reason, "a wrong known answer");
  EXPECT_EQ(detector.health().wrong_answers, 1u);
  EXPECT_EQ(detector.health().alterations, 0u);
}

TEST(Failover, GivesNoResultWhereNoBackendIsLeft) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const auto faulty = test::make_faulty_backend(*simd, wrong_count(0));
  FailoverDetector detector({faulty.get()}, kWidth, kHeight, posing(), always());
  const FrameResult& result = detector.detect(picture(0), stamped(9));
  EXPECT_EQ(result.status, FrameStatus::device_lost);
  EXPECT_TRUE(result.detections.empty());
  EXPECT_EQ(result.stamp.sequence, 9u);
  EXPECT_EQ(detector.health().mode, HealthMode::failed);
  EXPECT_EQ(detector.active(), 0u);
}

TEST(KnownAnswer, IsRightWithDigestsToo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  DetectorConfig config = posing();
  config.digests = true;
  FailoverDetector detector({backend.get()}, kWidth, kHeight, config, always());
  EXPECT_EQ(detector.detect(picture(0), stamped(0)).status, FrameStatus::ok);
  EXPECT_EQ(detector.health().mode, HealthMode::nominal);
  PipelineConfig paced;
  paced.detector = config;
  paced.health = always();
  const Pipeline pipeline({backend.get()}, kWidth, kHeight, paced, [](const PipelineFrame&) {});
  EXPECT_EQ(pipeline.health().mode, HealthMode::nominal);
  EXPECT_GT(pipeline.health().known_answers, 0u);
}

TEST(Pipeline, LosesNoFrameToABackendThatAnswersWrongly) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const std::unique_ptr<Backend> cpu = open_backend("cpu");
  for (const bool tracks : {false, true}) {
    // The first slot's whole frames: the picture at start, then a frame and the picture in turn; frames in windows are
    // other plans'.
    const auto faulty = test::make_faulty_backend(*simd, wrong_count(tracks ? 2 : 4));
    PipelineConfig config;
    config.detector = posing();
    config.overrun = Overrun::wait;
    config.health = always();
    if (tracks) config.tracking = TrackerConfig();
    Judge judge(config.detector);
    u64 seen = 0;
    std::size_t last = 0;
    Pipeline pipeline({faulty.get(), cpu.get()}, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
      EXPECT_GE(frame.backend, last);
      last = frame.backend;
      ++seen;
      if (!tracks) judge(frame);
    });
    EXPECT_EQ(pipeline.health().known_answers, 8u);  // four slots, two backends
    pipeline.start();
    for (u64 i = 0; i < 60; ++i) EXPECT_TRUE(pipeline.push(picture(i), stamped(i)));
    pipeline.stop();
    EXPECT_EQ(seen, 60u);
    EXPECT_EQ(last, 1u);
    EXPECT_EQ(pipeline.counts().device_lost, 0u);
    EXPECT_GE(pipeline.counts().run_again, 1u);
    EXPECT_EQ(pipeline.health().mode, HealthMode::fallback);
    EXPECT_EQ(pipeline.health().wrong_answers, 1u);
    EXPECT_STREQ(pipeline.health().reason, "a wrong known answer");
  }
}

TEST(Pipeline, AllocatesNothingToLookAfterItself) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.detector = posing();
  config.overrun = Overrun::wait;
  config.health = always();
  ASSERT_EQ(frames().size(), kPictures);  // drawn by now
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config, [](const PipelineFrame&) {});
  pipeline.start();
  const std::size_t started = test::allocations();
  for (u64 i = 0; i < 40; ++i) pipeline.push(picture(i), stamped(i));
  pipeline.close();
  while (pipeline.counts().delivered < 40) std::this_thread::yield();
  EXPECT_EQ(test::allocations(), started);
  EXPECT_EQ(pipeline.health().known_answers, 44u);
  EXPECT_GT(pipeline.health().checked_bytes, 40u * 8000);
  pipeline.stop();
}

TEST(Pipeline, DeliversNoResultOnceNoBackendIsLeft) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const auto faulty = test::make_faulty_backend(*simd, wrong_count(2));
  PipelineConfig config;
  config.overrun = Overrun::wait;
  config.health = always();
  u64 lost = 0, whole = 0;
  Pipeline pipeline({faulty.get()}, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
    ++(frame.result->status == FrameStatus::device_lost ? lost : whole);
    EXPECT_EQ(whole, 0u);
  });
  pipeline.start();
  for (u64 i = 0; i < 10; ++i) EXPECT_TRUE(pipeline.push(picture(i), stamped(i)));
  pipeline.stop();
  EXPECT_EQ(lost, 10u);
  EXPECT_EQ(pipeline.health().mode, HealthMode::failed);
}

}  // namespace
}  // namespace berth
