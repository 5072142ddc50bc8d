// What callbacks and backends throw comes out of stop, and a lost device costs no frame where there is another.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <stdexcept>
#include <thread>

#include "berth/pipeline.hpp"
#include "support/faulty_backend.hpp"
#include "support/forwarding_backend.hpp"
#include "support/pipeline_frames.hpp"

namespace berth {
namespace {

using namespace test::pipeline;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(PipelineFailure, WhatACallbackThrowsEndsItAndComesOutOfStop) {
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

/// A backend that throws where none should: in one replay, or in one wait for the device.
struct Throws {
  int in_replay = -1, in_finish = -1;
  std::atomic<int> replays = 0, waits = 0;
};

class ThrowingStream final : public test::ForwardingStream {
 public:
  ThrowingStream(std::unique_ptr<Stream> behind, Throws& throws)
      : ForwardingStream(std::move(behind)), throws_(throws) {}
  void replay(Plan& plan) override {
    if (throws_.replays++ == throws_.in_replay) throw std::runtime_error("no replay");
    behind().replay(plan);
  }
  bool finish() override {
    if (throws_.waits++ == throws_.in_finish) throw std::runtime_error("no wait");
    return behind().finish();
  }

 private:
  Throws& throws_;
};

TEST(PipelineFailure, WhatABackendThrowsEndsItAndComesOutOfStop) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  for (const bool on_host : {false, true}) {
    for (const bool calls_back : {false, true}) {
      SCOPED_TRACE(testing::Message() << (on_host ? "host" : "device") << (calls_back ? ", callback" : ", reader"));
      Throws throws;
      test::ForwardingBackend backend("throwing", *simd, [&](std::unique_ptr<Stream> behind) {
        return std::make_unique<ThrowingStream>(std::move(behind), throws);
      });
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

TEST(PipelineFailure, ALostDeviceCostsNoFrameWhereThereIsAnother) {
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

TEST(PipelineFailure, SaysSoWhenTheLastDeviceIsLost) {
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

}  // namespace
}  // namespace berth
