// A backend that was left is opened anew, believed once it has proven itself, and gone back to: no frame is lost, none
// comes before an earlier one, and the bits stay the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "berth/error.hpp"
#include "berth/failover.hpp"
#include "frame/marker_plan.hpp"
#include "support/faulty_backend.hpp"
#include "support/pipeline_frames.hpp"

namespace berth {
namespace {

using namespace test::pipeline;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

using Open = std::function<std::unique_ptr<Backend>(std::size_t)>;

/// Nothing is asked but at start and where a backend takes over.
HealthConfig recovering(Open open) {
  HealthConfig health;
  health.known_answer_every_ns = 0;
  RecoveryConfig recovery;
  recovery.open = std::move(open);
  recovery.first_wait_ns = 1'000'000;
  recovery.longest_wait_ns = 4'000'000;
  recovery.right_answers = 3;
  recovery.most_returns = 2;
  health.recovery = recovery;
  return health;
}

test::Fault lost_at(int replay) {
  test::Fault fault;
  fault.lose_frame = replay;
  return fault;
}

/// How many run ends there were, which the host reads, turns a bit over in one replay.
test::Fault wrong_at(const MarkerPlan& plan, int replay) {
  test::Fault fault;
  for (std::size_t i = 0; i < plan.steps().size(); ++i) {
    if (plan.steps()[i].op == Op::contour_collect && fault.flip_step < 0) fault.flip_step = static_cast<int>(i);
  }
  fault.flip_argument = 2;
  fault.flip_frame = replay;
  return fault;
}

/// A faulty backend over one of its own.
class OwnFaulty final : public Backend {
 public:
  explicit OwnFaulty(const test::Fault& fault) : faulty_(*behind_, fault) {}
  const char* name() const override { return faulty_.name(); }
  DeviceInfo device() const override { return faulty_.device(); }
  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override { return faulty_.make_buffer(bytes); }
  std::unique_ptr<Stream> make_stream() override { return faulty_.make_stream(); }
  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override { return faulty_.record(steps); }

 private:
  const std::unique_ptr<Backend> behind_ = open_backend("simd");
  test::FaultyBackend faulty_;
};

/// A pipeline on a backend that is lost in its sixth frame on one slot, and another; every frame is judged.
class FailBack : public ::testing::Test {
 protected:
  void start(Open open, bool has_another = true, bool tracks = false) {
    PipelineConfig config;
    config.detector = posing();
    config.overrun = Overrun::wait;
    config.slots = 3;
    config.health = recovering(std::move(open));
    if (tracks) config.tracking = TrackerConfig();
    std::vector<Backend*> chain = {faulty_.get()};
    if (has_another) chain.push_back(other_.get());
    // What it is asked at start is its first replay.
    pipeline_ = std::make_unique<Pipeline>(chain, kWidth, kHeight, config, [this, tracks](const PipelineFrame& frame) {
      backend_ = frame.backend;
      if (frame.result->status == FrameStatus::device_lost) {
        ++lost_;
      } else if (!tracks) {
        judge_(frame);
      } else {
        ++tracked_;
      }
    });
    pipeline_->start();
  }
  /// Frames go in until it is so, and a few more.
  template <class Condition>
  void play_until(const Condition& is_so) {
    for (int more = 0; more < 12; more += is_so() ? 1 : 0) {
      EXPECT_TRUE(pipeline_->push(picture(pushed_), stamped(pushed_)));
      ++pushed_;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the recovery's thread gives way to all others
    }
  }
  void stop() {
    pipeline_->stop();
    EXPECT_EQ(pipeline_->counts().delivered, pushed_);
    EXPECT_EQ(judge_.seen() + lost_ + tracked_, pushed_);
  }

  const std::unique_ptr<Backend> simd_ = open_backend("simd");
  const std::unique_ptr<Backend> other_ = open_backend("simd");
  const std::unique_ptr<Backend> faulty_ = test::make_faulty_backend(*simd_, lost_at(6));
  Judge judge_{posing()};
  u64 pushed_ = 0, lost_ = 0, tracked_ = 0;
  std::size_t backend_ = 0;
  std::atomic<int> opened_ = 0;         // by the recovery's thread
  std::unique_ptr<Pipeline> pipeline_;  // last: its threads use the rest
};

TEST_F(FailBack, TakesUpADeviceThatIsBack) {
  start([this](std::size_t number) {
    EXPECT_EQ(number, 0u);
    // Twice it is not there yet.
    if (++opened_ < 3) throw Error("no device");
    return open_backend("simd");
  });
  play_until([&] { return pipeline_->health().returns == 1; });
  const HealthReport health = pipeline_->health();
  EXPECT_EQ(health.mode, HealthMode::nominal);
  EXPECT_EQ(health.tries, 3u);
  EXPECT_STREQ(health.reason, "its device was lost");
  EXPECT_STREQ(health.recovery, "");
  EXPECT_EQ(health.wrong_answers, 0u);
  stop();
  EXPECT_EQ(backend_, 0u);
  EXPECT_EQ(lost_, 0u);
  EXPECT_GE(pipeline_->counts().run_again, 1u);
}

TEST_F(FailBack, TakesUpADeviceThatIsBackWhereWindowsAreSearched) {
  start([](std::size_t) { return open_backend("simd"); }, true, true);
  play_until([&] { return pipeline_->health().returns == 1; });
  stop();
  EXPECT_EQ(backend_, 0u);
  EXPECT_EQ(lost_, 0u);
}

TEST_F(FailBack, DoesNotBelieveWrongAnswers) {
  // The third round's.
  const test::Fault fault = wrong_at(MarkerPlan(*simd_, kWidth, kHeight, {}), 2);
  start([fault](std::size_t) { return std::make_unique<OwnFaulty>(fault); });
  play_until([&] { return pipeline_->health().tries >= 2; });
  EXPECT_STREQ(pipeline_->health().recovery, "trying");
  stop();
  EXPECT_EQ(backend_, 1u);
  EXPECT_EQ(pipeline_->health().returns, 0u);
  EXPECT_EQ(pipeline_->health().mode, HealthMode::fallback);
}

TEST_F(FailBack, GivesUpADeviceThatComesAndGoes) {
  // Proven, asked once more, and lost again after two frames on one slot.
  start([](std::size_t) { return std::make_unique<OwnFaulty>(lost_at(6)); });
  play_until([&] { return pipeline_->health().recovery == std::string("given up"); });
  const u64 tries = pipeline_->health().tries;
  stop();
  EXPECT_EQ(pipeline_->health().returns, 2u);
  EXPECT_EQ(pipeline_->health().tries, tries);
  EXPECT_EQ(backend_, 1u);
  EXPECT_EQ(lost_, 0u);
}

TEST_F(FailBack, BringsResultsBackWhereNoneWasLeft) {
  start([](std::size_t) { return open_backend("simd"); }, false);
  play_until([&] { return pipeline_->health().returns == 1; });
  EXPECT_EQ(pipeline_->health().mode, HealthMode::nominal);
  stop();
  EXPECT_GT(lost_, 0u);
  EXPECT_EQ(pipeline_->counts().device_lost, lost_);
  EXPECT_GE(judge_.seen(), 12u);
}

TEST(FailBackOfADetector, KeepsBitsAndCountsEachWay) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const std::unique_ptr<Backend> cpu = open_backend("cpu");
  const auto faulty = test::make_faulty_backend(*simd, lost_at(4));
  FailoverDetector detector({faulty.get(), cpu.get()}, kWidth, kHeight, posing(),
                            recovering([](std::size_t) { return std::make_unique<OwnFaulty>(lost_at(9)); }));
  const std::vector<FrameResult> wanted = expected(posing());
  std::vector<std::size_t> ways = {0};
  for (u64 i = 0; detector.health().recovery != std::string("given up"); ++i) {
    expect_same(detector.detect(picture(i), stamped(i)), wanted[i % kPictures]);
    if (detector.active() != ways.back()) ways.push_back(detector.active());
  }
  EXPECT_EQ(ways, (std::vector<std::size_t>{0, 1, 0, 1, 0, 1}));
  EXPECT_EQ(detector.health().returns, 2u);
  // What was opened anew goes with it, in whatever order that is.
  FailoverDetector other({cpu.get()}, kWidth, kHeight, posing());
  detector = std::move(other);
  EXPECT_EQ(detector.detect(picture(0), stamped(0)).detections.size(), wanted[0].detections.size());
}

TEST(FailBackOfADetector, RefusesWhatMakesNoSense) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const auto make = [&](const HealthConfig& health) {
    return FailoverDetector({simd.get()}, kWidth, kHeight, posing(), health);
  };
  HealthConfig health = recovering({});
  EXPECT_THAT([&] { make(health); }, ThrowsMessage<Error>(HasSubstr("opens no backend")));
  health = recovering([](std::size_t) { return open_backend("simd"); });
  health.recovery->longest_wait_ns = 10;
  EXPECT_THAT([&] { make(health); }, ThrowsMessage<Error>(HasSubstr("1000000 to 10 ns")));
  health = recovering([](std::size_t) { return open_backend("simd"); });
  health.recovery->right_answers = 0;
  EXPECT_THAT([&] { make(health); }, ThrowsMessage<Error>(HasSubstr("by 0 right answers")));
}

TEST(KnownAnswerOfWindows, IsAskedOnEveryPlanInTurn) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const std::unique_ptr<Backend> cpu = open_backend("cpu");
  DetectorConfig config = posing();
  config.window_sides = {128, 96, 96};
  HealthConfig always;
  always.known_answer_every_ns = 1;
  const std::vector<FrameResult> wanted = expected(posing());
  // Recorded after the whole frame's, two for each window.
  for (const int plan : {1, 2, 3, 4, 5, 6}) {
    SCOPED_TRACE(plan);
    test::Fault fault = wrong_at(MarkerPlan::of_window(*simd, plan <= 2 ? 128 : 96, config), 1);
    fault.flip_bit = 12;  // more than there is room for: of two windows the fuller one is told of
    fault.flip_plan = plan;
    const auto faulty = test::make_faulty_backend(*simd, fault);
    FailoverDetector detector({faulty.get(), cpu.get()}, kWidth, kHeight, config, always);
    EXPECT_EQ(detector.health().mode, HealthMode::nominal);
    for (u64 i = 0; i < 4; ++i) expect_same(detector.detect(picture(i), stamped(i)), wanted[i]);
    EXPECT_EQ(detector.health().mode, HealthMode::fallback);
    EXPECT_STREQ(detector.health().reason, "a wrong known answer");
  }
}

}  // namespace
}  // namespace berth
