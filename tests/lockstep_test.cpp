// Two backends in lockstep see a flipped bit on its very frame; a lost device costs no frame.
#include "berth/lockstep.hpp"

#include <gtest/gtest.h>

#include "berth/failover.hpp"
#include "frame/marker_plan.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/faulty_backend.hpp"

namespace berth {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;

GrayImage picture(int index) { return sim::render(sim::corpus_scene("easy", index, kWidth, kHeight)); }

/// One step of the plan: the first that runs the operation.
int step_of(Op op) {
  const std::unique_ptr<Backend> backend = open_backend("cpu");
  const MarkerPlan plan(*backend, kWidth, kHeight, {});
  for (std::size_t i = 0; i < plan.steps().size(); ++i) {
    if (plan.steps()[i].op == op) return static_cast<int>(i);
  }
  return -1;
}

void expect_same_markers(const FrameResult& found, const FrameResult& wanted) {
  ASSERT_EQ(found.detections.size(), wanted.detections.size());
  for (std::size_t i = 0; i < found.detections.size(); ++i) {
    EXPECT_EQ(found.detections[i].id, wanted.detections[i].id);
    EXPECT_EQ(found.detections[i].corners, wanted.detections[i].corners);
  }
}

TEST(Lockstep, EveryBackendAgreesWithTheReference) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty()) continue;
    const std::unique_ptr<Backend> backend = open_backend(status.name);
    Lockstep both(*backend, *reference, kWidth, kHeight, {});
    for (int i = 0; i < 3; ++i) {
      EXPECT_FALSE(both.detect(picture(i).view()).detections.empty()) << status.name << " frame " << i;
      EXPECT_FALSE(both.difference()) << status.name << " frame " << i << ": " << to_string(*both.difference());
    }
  }
}

struct Flip {
  Op op;
  int argument;
  std::size_t word;
  int bit;
  const char* stage;
};

class LockstepFlip : public testing::TestWithParam<Flip> {};

TEST_P(LockstepFlip, IsSeenOnItsFrameAndNamedWithBothValues) {
  const Flip& flip = GetParam();
  constexpr int kFrame = 2;
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::Fault fault;
  fault.flip_step = step_of(flip.op);
  ASSERT_GE(fault.flip_step, 0);
  fault.flip_argument = flip.argument;
  fault.flip_word = flip.word;
  fault.flip_bit = flip.bit;
  fault.flip_frame = kFrame;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  Lockstep both(*simd, *faulty, kWidth, kHeight, {});
  for (int i = 0; i < 5; ++i) {
    both.detect(picture(i).view());
    if (i != kFrame) {
      EXPECT_FALSE(both.difference()) << i;
      continue;
    }
    ASSERT_TRUE(both.difference()) << i;
    EXPECT_EQ(both.difference()->stage, flip.stage);
    EXPECT_EQ(both.difference()->word, flip.word);
    ASSERT_TRUE(both.difference()->first && both.difference()->second);
    EXPECT_EQ(*both.difference()->first ^ *both.difference()->second, 1u << flip.bit);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Stages, LockstepFlip,
    testing::Values(Flip{Op::tile_extrema, 1, 17, 3, "tile_minima"}, Flip{Op::normalize, 1, 3, 0, "normalize"},
                    Flip{Op::threshold, 4, 1203, 31, "threshold"}, Flip{Op::despeckle, 1, 77, 12, "despeckle"},
                    Flip{Op::run_link, 3, 5, 20, "run_link"}, Flip{Op::contour_trace, 2, 1, 4, "contour_trace"},
                    Flip{Op::halve, 1, 600, 7, "halve"}));

TEST(Lockstep, ALostDeviceLeavesTheOthersResult) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::Fault fault;
  fault.lose_frame = 1;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  Lockstep both(*faulty, *simd, kWidth, kHeight, {});
  Detector alone(*simd, kWidth, kHeight, {});
  for (int i = 0; i < 3; ++i) {
    const GrayImage image = picture(i);
    const FrameResult& result = both.detect(image.view());
    EXPECT_NE(result.status, FrameStatus::device_lost);
    expect_same_markers(result, alone.detect(image.view()));
    EXPECT_EQ(both.device_lost(), i >= 1);
    EXPECT_FALSE(both.difference());
  }
}

TEST(Failover, RunsTheFrameInFlightAgainOnTheNextBackend) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const std::unique_ptr<Backend> cpu = open_backend("cpu");
  test::Fault fault;
  fault.lose_frame = 2;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  FailoverDetector detector({faulty.get(), cpu.get()}, kWidth, kHeight, {});
  Detector alone(*simd, kWidth, kHeight, {});
  for (int i = 0; i < 4; ++i) {
    const GrayImage image = picture(i);
    FrameStamp stamp;
    stamp.sequence = 40 + static_cast<u64>(i);
    const FrameResult& result = detector.detect(image.view(), stamp);
    EXPECT_EQ(result.status, FrameStatus::ok) << i;
    EXPECT_EQ(result.stamp.sequence, stamp.sequence);
    EXPECT_EQ(detector.active(), i < 2 ? 0u : 1u);
    expect_same_markers(result, alone.detect(image.view()));
  }
}

TEST(Failover, SaysSoWhenEveryDeviceIsLost) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::Fault fault;
  fault.lose_frame = 0;
  const std::unique_ptr<Backend> first = test::make_faulty_backend(*simd, fault);
  const std::unique_ptr<Backend> second = test::make_faulty_backend(*simd, fault);
  FailoverDetector detector({first.get(), second.get()}, kWidth, kHeight, {});
  EXPECT_EQ(detector.detect(picture(0).view()).status, FrameStatus::device_lost);
  EXPECT_EQ(detector.detect(picture(1).view()).status, FrameStatus::device_lost);
}

}  // namespace
}  // namespace berth
