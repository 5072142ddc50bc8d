// Times of a device that works beside the host, whoever reaches its memory.
#include <gtest/gtest.h>

#include <vector>

#include "frame/detector_parts.hpp"
#include "monotonic.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/forwarding_backend.hpp"

namespace berth {
namespace {

/// Like a driver whose device is the processor: the host reaches the buffers, and plans run when someone waits.
struct Lazy {
  bool is_flushed = false;
  std::int64_t began_ns = 0;
};

class LazyStream final : public test::ForwardingStream {
 public:
  LazyStream(std::unique_ptr<Stream> behind, Lazy& lazy) : ForwardingStream(std::move(behind)), lazy_(lazy) {}
  void replay(Plan& plan) override {
    plans_.push_back(&plan);
    lazy_.is_flushed = false;
  }
  void flush() override { lazy_.is_flushed = true; }
  bool is_immediate() const override { return false; }
  bool finish() override {
    lazy_.began_ns = monotonic_ns();
    for (Plan* plan : plans_) behind().replay(*plan);
    plans_.clear();
    return behind().finish();
  }

 private:
  Lazy& lazy_;
  std::vector<Plan*> plans_;
};

TEST(DeviceFrame, IsDoneWhenTheDeviceIsNotWhenTheFrameIsEnqueued) {
  Lazy lazy;
  const std::unique_ptr<Backend> simd = open_backend("simd");
  test::ForwardingBackend backend("lazy", *simd, [&](std::unique_ptr<Stream> behind) {
    return std::make_unique<LazyStream>(std::move(behind), lazy);
  });
  DetectorConfig config;
  config.window_sides = {208};
  DeviceFrame frame(backend, 640, 480, config, false);
  EXPECT_GT(lazy.began_ns, 0) << "warmed up: a driver may compile in the first frame";
  const GrayImage image = sim::render(sim::corpus_scene("easy", 3, 640, 480));
  pad_frame(image.view(), frame.geometry(), frame.pixels());
  for (const bool in_windows : {false, true}) {
    if (in_windows) {
      frame.submit_windows(image.view(), {{208, 64, 64}});
    } else {
      frame.submit();
    }
    EXPECT_TRUE(lazy.is_flushed) << "nothing is held back until someone waits";
    EXPECT_TRUE(frame.finish());
    EXPECT_GE(frame.done_ns(), lazy.began_ns);
    EXPECT_LE(frame.submitted_ns(), lazy.began_ns);
  }
}

TEST(DeviceFrame, IsDoneOnceEnqueuedWhereThereIsNoDevice) {
  for (const char* name : {"simd", "cpu"}) {
    const std::unique_ptr<Backend> backend = open_backend(name);
    EXPECT_TRUE(backend->make_stream()->is_immediate());
    DeviceFrame frame(*backend, 320, 240, {}, false);
    frame.submit();
    const std::int64_t enqueued_ns = monotonic_ns();
    EXPECT_TRUE(frame.finish());
    EXPECT_LE(frame.done_ns(), enqueued_ns) << name;
  }
}

TEST(DeviceFrame, DriversWorkBesideTheHost) {
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty()) continue;
    const bool is_driver = status.name == "vulkan" || status.name == "opencl" || status.name == "cuda";
    EXPECT_EQ(open_backend(status.name)->make_stream()->is_immediate(), !is_driver) << status.name;
  }
}

}  // namespace
}  // namespace berth
