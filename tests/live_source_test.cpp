// What a camera hands over that must not be taken for a new frame: times that cannot be, pictures that it hangs on.
#include "camera/live_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

#include "camera/frame_check.hpp"
#include "monotonic.hpp"
#include "support/complaint.hpp"

namespace berth {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;

TEST(TimeCheck, TakesTimesThatGoOn) {
  TimeCheck check;
  for (std::int64_t i = 1; i < 100; ++i) EXPECT_EQ(check.look(i * 10 * kMs, i * 11 * kMs, false), TimeVerdict::fine);
}

TEST(TimeCheck, NamesTimesThatCannotBe) {
  TimeCheck check;
  EXPECT_EQ(check.look(100 * kMs, 110 * kMs, true), TimeVerdict::fine);
  EXPECT_EQ(check.look(100 * kMs, 120 * kMs, true), TimeVerdict::again);
  EXPECT_EQ(check.look(90 * kMs, 120 * kMs, true), TimeVerdict::back);
  EXPECT_EQ(check.look(140 * kMs, 130 * kMs, true), TimeVerdict::ahead);
  EXPECT_EQ(check.look(110 * kMs, 130 * kMs, true), TimeVerdict::fine) << "one bad time spoils no other";
}

TEST(TimeCheck, TakesACamerasOwnClockForWhatItWas) {
  TimeCheck check;
  EXPECT_EQ(check.look(5'000 * kMs, 10 * kMs, false), TimeVerdict::fine) << "any start will do";
  EXPECT_EQ(check.look(5'020 * kMs, 130 * kMs, false), TimeVerdict::fine) << "held up by 100 ms on the way";
  EXPECT_EQ(check.look(5'150 * kMs, 140 * kMs, false), TimeVerdict::fine);
  EXPECT_EQ(check.look(6'150 * kMs, 150 * kMs, false), TimeVerdict::ahead);
}

TEST(TimeCheck, AClockThatWasSetIsBelievedAfterThreeFrames) {
  for (const std::int64_t shift : {-10'000 * kMs, 10'000 * kMs}) {
    TimeCheck check;
    EXPECT_EQ(check.look(20'000 * kMs, 10 * kMs, false), TimeVerdict::fine);
    int doubted = 0;
    std::int64_t i = 1;
    while (check.look(20'000 * kMs + shift + i * 10 * kMs, (i + 1) * 10 * kMs, false) != TimeVerdict::fine) {
      ++doubted;
      ASSERT_LT(++i, 10);
    }
    EXPECT_EQ(doubted, TimeCheck::kSetAfter - 1);
    ++i;
    EXPECT_EQ(check.look(20'000 * kMs + shift + i * 10 * kMs, (i + 1) * 10 * kMs, false), TimeVerdict::fine);
  }
  TimeCheck same;
  for (std::int64_t i = 1; i < 10; ++i) EXPECT_EQ(same.look((i + 100) * kMs, i * kMs, true), TimeVerdict::ahead);
}

TEST(TimeCheck, FramesWithoutATimeSayNothing) {
  TimeCheck check;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(check.look(0, i, true), TimeVerdict::fine);
}

TEST(RepeatCheck, OneBitMakesAnotherPicture) {
  GrayImage image(70, 9);
  for (int i = 0; i < 70 * 9; ++i) image.view().at(i % 70, i / 70) = static_cast<u8>(i * 37);
  RepeatCheck check;
  EXPECT_FALSE(check.is_repeat(image.view()));
  EXPECT_TRUE(check.is_repeat(image.view()));
  for (int i = 0; i < 70 * 9; ++i) {
    image.view().at(i % 70, i / 70) ^= static_cast<u8>(1U << (i % 8));
    EXPECT_FALSE(check.is_repeat(image.view())) << i;
    EXPECT_TRUE(check.is_repeat(image.view()));
  }
}

TEST(RepeatCheck, OneGreyLevelTellsNothing) {
  const GrayImage black(40, 30);
  RepeatCheck check;
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(check.is_repeat(black.view()));
}

/// Its frames are 8 x 2 pixels that count from `shade` on.
struct Given {
  int shade;
  std::int64_t time_ns;
};

class ShortCamera final : public LiveCamera {
 public:
  explicit ShortCamera(std::deque<Given>& frames) : frames_(frames) {}
  int take(int, Filled& filled) override {
    if (frames_.empty()) return ETIMEDOUT;
    shade_ = frames_.front().shade;
    filled = Filled();
    filled.time_ns = frames_.front().time_ns;
    filled.clock = "monotonic";
    filled.sequence = sequence_++;
    frames_.pop_front();
    return 0;
  }
  int give_back(const Filled&) override { return 0; }
  bool read(const Filled&, View2D<u8> image) const override {
    for (int i = 0; i < 16; ++i) image.at(i % 8, i / 8) = static_cast<u8>(shade_ + i);
    return true;
  }
  int width() const override { return 8; }
  int height() const override { return 2; }
  std::int64_t exposure_ns() const override { return 0; }

 private:
  std::deque<Given>& frames_;
  int shade_ = 0;
  std::uint32_t sequence_ = 0;
};

class LiveSource : public testing::Test {
 protected:
  std::unique_ptr<CameraSource> opened(bool repeats = false) {
    LiveOptions options;
    options.name = "short";
    options.buffers = 1;
    options.watchdog_ms = 20;
    options.repeats = repeats;
    return open_live(options, [this] { return std::make_unique<ShortCamera>(frames_); });
  }
  int next_shade(Source& source) { return source.next()->image.view().at(0, 0); }
  std::deque<Given> frames_;
};

TEST_F(LiveSource, HandsOnNoFrameWhoseTimeCannotBe) {
  const std::int64_t now = monotonic_ns();
  frames_ = {{1, now - 50 * kMs}, {2, now - 50 * kMs},     {3, now - 60 * kMs},
             {4, now - 40 * kMs}, {5, now + 60'000 * kMs}, {6, now - 30 * kMs}};
  const auto source = opened();
  EXPECT_EQ(next_shade(*source), 1);
  EXPECT_EQ(next_shade(*source), 4);
  const SourceFrame last = *source->next();
  EXPECT_EQ(last.image.view().at(0, 0), 6);
  EXPECT_EQ(last.stamp.sequence, 2U) << "only frames handed on count";
  EXPECT_EQ(source->health().repeated, 1U);
  EXPECT_EQ(source->health().misdated, 2U);
}

TEST_F(LiveSource, HandsOnNoPictureTwice) {
  const std::int64_t now = monotonic_ns();
  for (int i = 0; i < 6; ++i) frames_.push_back({i < 5 ? 1 : 2, now - (60 - i) * kMs});
  const auto source = opened();
  EXPECT_EQ(next_shade(*source), 1);
  EXPECT_EQ(next_shade(*source), 2);
  EXPECT_EQ(source->health().repeated, 4U);
  frames_ = {{2, now - 20 * kMs}, {2, now - 10 * kMs}};
  const auto all = opened(true);
  EXPECT_EQ(next_shade(*all), 2);
  EXPECT_EQ(next_shade(*all), 2);
}

TEST_F(LiveSource, ACameraThatHangsIsLostAndHandsNothingOnWhenItHangsOn) {
  const auto source = opened();
  frames_ = {{1, monotonic_ns() - kMs}};
  EXPECT_EQ(next_shade(*source), 1);
  for (int round = 0; round < 2; ++round) {
    // Always one more frame, the same.
    std::string complaint;
    const std::int64_t until = monotonic_ns() + 5'000 * kMs;
    while (complaint.empty() && monotonic_ns() < until) {
      for (int i = 1; i <= 1000; ++i) frames_.push_back({1, monotonic_ns() - 2 * kMs + i});
      complaint = test::complaint([&] { source->next(); });
      frames_.clear();
    }
    EXPECT_THAT(complaint, HasSubstr("the camera is lost (no "));
    EXPECT_GE(source->health().repeated, 1U);
  }
  frames_ = {{9, monotonic_ns()}};
  EXPECT_EQ(next_shade(*source), 9);
  EXPECT_EQ(source->health().reopened, 2U);
}

}  // namespace
}  // namespace berth
