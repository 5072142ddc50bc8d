// What a pipeline makes of frames is what a Detector makes of them, whatever its slots, threads, drops and losses.
#include "berth/pipeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "berth/error.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/counted_allocations.hpp"
#include "support/faulty_backend.hpp"
#include "support/pictures.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kWidth = 280;  // rows are padded
constexpr int kHeight = 210;
constexpr std::size_t kPictures = 6;

const std::vector<GrayImage>& frames() {
  static const std::vector<GrayImage> all = [] {
    std::vector<GrayImage> images;
    for (std::size_t i = 0; i + 1 < kPictures; ++i) {
      images.push_back(sim::render(sim::corpus_scene("easy", static_cast<int>(i), kWidth, kHeight)));
    }
    images.push_back(pictures::mazes(kWidth, kHeight, 3));
    return images;
  }();
  return all;
}

View2D<const u8> picture(u64 sequence) { return frames()[sequence % kPictures].view(); }

DetectorConfig posing() {
  DetectorConfig config;
  config.camera = paper_camera(kWidth, kHeight);
  config.marker_size_m = 0.1;
  return config;
}

FrameStamp stamped(u64 sequence) {
  FrameStamp stamp;
  stamp.sequence = sequence;
  return stamp;
}

/// What the plain detector makes of every picture.
std::vector<FrameResult> expected(const DetectorConfig& config) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector detector(*backend, kWidth, kHeight, config);
  std::vector<FrameResult> results;
  for (u64 i = 0; i < kPictures; ++i) results.push_back(detector.detect(picture(i)));
  return results;
}

void expect_same(const FrameResult& found, const FrameResult& wanted) {
  EXPECT_EQ(found.status, wanted.status);
  EXPECT_EQ(found.quads, wanted.quads);
  ASSERT_EQ(found.detections.size(), wanted.detections.size());
  for (std::size_t i = 0; i < wanted.detections.size(); ++i) {
    const Detection& a = found.detections[i];
    const Detection& b = wanted.detections[i];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.corners, b.corners);
    EXPECT_EQ(a.has_pose, b.has_pose);
    EXPECT_EQ(a.pose.R, b.pose.R);
    EXPECT_EQ(a.pose.t, b.pose.t);
    ASSERT_EQ(a.pose_uncertainty.has_value(), b.pose_uncertainty.has_value());
    if (b.pose_uncertainty) {
      EXPECT_EQ(a.pose_uncertainty->covariance, b.pose_uncertainty->covariance);
    }
  }
  ASSERT_EQ(found.digests.size(), wanted.digests.size());
  for (std::size_t i = 0; i < wanted.digests.size(); ++i) {
    EXPECT_EQ(found.digests[i].digest, wanted.digests[i].digest) << wanted.digests[i].stage;
  }
}

/// Checks each frame that is delivered against the detector's result, and that none comes before an earlier one.
class Judge {
 public:
  explicit Judge(const DetectorConfig& config) : wanted_(expected(config)) {}
  void operator()(const PipelineFrame& frame) {
    const u64 sequence = frame.result->stamp.sequence;
    EXPECT_TRUE(seen_ == 0 || sequence > last_) << sequence << " after " << last_;
    SCOPED_TRACE(sequence);
    expect_same(*frame.result, wanted_[sequence % kPictures]);
    EXPECT_EQ(frame.image.at(kWidth - 1, 7), picture(sequence).at(kWidth - 1, 7));
    last_ = sequence;
    ++seen_;
  }
  u64 seen() const { return seen_; }

 private:
  std::vector<FrameResult> wanted_;
  u64 last_ = 0, seen_ = 0;
};

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

TEST(Pipeline, WhatACallbackThrowsEndsItAndComesOutOfStop) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  PipelineConfig config;
  config.overrun = Overrun::wait;
  int calls = 0;
  Pipeline pipeline({backend.get()}, kWidth, kHeight, config, [&](const PipelineFrame&) {
    if (++calls == 3) throw std::runtime_error("the log is full");
  });
  pipeline.start();
  u64 offered = 0;
  while (pipeline.push(picture(offered), stamped(offered))) ++offered;
  EXPECT_THAT([&] { pipeline.stop(); }, ThrowsMessage<std::runtime_error>(HasSubstr("the log is full")));
  EXPECT_EQ(calls, 3);
  const PipelineCounts counts = pipeline.counts();
  EXPECT_EQ(counts.delivered + counts.all_dropped(), counts.offered);
  calls = 3;
  pipeline.start();
  EXPECT_TRUE(pipeline.push(picture(0), stamped(0)));
  pipeline.stop();
  EXPECT_EQ(calls, 4);
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

/// A backend that throws where none should: in one replay, or in one wait for the device.
struct Throws {
  int in_replay = -1, in_finish = -1;
  std::atomic<int> replays = 0, waits = 0;
};

class ThrowingStream final : public Stream {
 public:
  ThrowingStream(std::unique_ptr<Stream> behind, Throws& throws) : behind_(std::move(behind)), throws_(throws) {}
  void upload(Buffer& buffer, const void* data, std::size_t bytes) override { behind_->upload(buffer, data, bytes); }
  void download(Buffer& buffer, void* data, std::size_t bytes) override { behind_->download(buffer, data, bytes); }
  void replay(Plan& plan) override {
    if (throws_.replays++ == throws_.in_replay) throw std::runtime_error("no replay");
    behind_->replay(plan);
  }
  std::unique_ptr<Event> record_event() override { return behind_->record_event(); }
  bool finish() override {
    if (throws_.waits++ == throws_.in_finish) throw std::runtime_error("no wait");
    return behind_->finish();
  }

 private:
  std::unique_ptr<Stream> behind_;
  Throws& throws_;
};

class ThrowingBackend final : public Backend {
 public:
  explicit ThrowingBackend(Throws& throws) : behind_(open_backend("simd")), throws_(throws) {}
  const char* name() const override { return "throwing"; }
  DeviceInfo device() const override { return behind_->device(); }
  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override { return behind_->make_buffer(bytes); }
  std::unique_ptr<Stream> make_stream() override {
    return std::make_unique<ThrowingStream>(behind_->make_stream(), throws_);
  }
  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override { return behind_->record(steps); }

 private:
  std::unique_ptr<Backend> behind_;
  Throws& throws_;
};

TEST(Pipeline, WhatABackendThrowsEndsItAndComesOutOfStop) {
  for (const bool on_host : {false, true}) {
    for (const bool calls_back : {false, true}) {
      SCOPED_TRACE(testing::Message() << (on_host ? "host" : "device") << (calls_back ? ", callback" : ", reader"));
      Throws throws;
      ThrowingBackend backend(throws);
      PipelineConfig config;
      config.overrun = Overrun::wait;
      Pipeline::Deliver deliver;
      if (calls_back) deliver = [](const PipelineFrame&) {};
      Pipeline pipeline({&backend}, kWidth, kHeight, config, deliver);
      pipeline.start();
      (on_host ? throws.in_finish : throws.in_replay) = (on_host ? throws.waits : throws.replays) + 3;
      std::thread camera([&] {
        for (u64 i = 0; pipeline.push(picture(i), stamped(i));) ++i;
      });
      if (!calls_back) {
        while (pipeline.next() != nullptr) continue;
      }
      camera.join();
      EXPECT_THAT([&] { pipeline.stop(); },
                  ThrowsMessage<std::runtime_error>(HasSubstr(on_host ? "no wait" : "no replay")));
      PipelineCounts counts = pipeline.counts();
      EXPECT_GE(counts.all_dropped(), 1u);
      EXPECT_EQ(counts.delivered + counts.all_dropped(), counts.offered);
      // It was that once only.
      pipeline.start();
      EXPECT_TRUE(pipeline.push(picture(0), stamped(0)));
      if (!calls_back) {
        EXPECT_NE(pipeline.next(), nullptr);
      }
      pipeline.stop();
      counts = pipeline.counts();
      EXPECT_EQ(counts.offered, 1u);
      EXPECT_EQ(counts.delivered, 1u);
    }
  }
}

TEST(Pipeline, ALostDeviceCostsNoFrameWhereThereIsAnother) {
  PipelineConfig config;
  config.detector = posing();
  config.overrun = Overrun::wait;
  Judge judge(config.detector);
  const std::unique_ptr<Backend> simd = open_backend("simd");
  const std::unique_ptr<Backend> cpu = open_backend("cpu");
  test::Fault fault;
  fault.lose_frame = 3;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  std::map<std::size_t, int> by_backend;
  Pipeline pipeline({faulty.get(), cpu.get()}, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
    ++by_backend[frame.backend];
    judge(frame);
  });
  pipeline.start();
  for (u64 i = 0; i < 40; ++i) pipeline.push(picture(i), stamped(i));
  pipeline.stop();
  EXPECT_EQ(judge.seen(), 40u);
  EXPECT_GT(by_backend[0], 0);
  EXPECT_GT(by_backend[1], 20);
  EXPECT_GE(pipeline.counts().run_again, 1u);
  EXPECT_LE(pipeline.counts().run_again, 3u);
  EXPECT_EQ(pipeline.counts().device_lost, 0u);
}

TEST(Pipeline, SaysSoWhenTheLastDeviceIsLost) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::Fault fault;
  fault.lose_frame = 2;
  const std::unique_ptr<Backend> faulty = test::make_faulty_backend(*simd, fault);
  PipelineConfig config;
  config.overrun = Overrun::wait;
  int lost = 0;
  Pipeline pipeline({faulty.get()}, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
    lost += frame.result->status == FrameStatus::device_lost ? 1 : 0;
  });
  pipeline.start();
  for (u64 i = 0; i < 30; ++i) pipeline.push(picture(i), stamped(i));
  pipeline.stop();
  EXPECT_GE(lost, 20);
  EXPECT_EQ(pipeline.counts().device_lost, static_cast<u64>(lost));
  EXPECT_EQ(pipeline.counts().delivered, 30u);
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
