// Times of a device that works beside the host, whoever reaches its memory.
#include <gtest/gtest.h>

#include <vector>

#include "frame/detector_parts.hpp"
#include "monotonic.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"

namespace berth {
namespace {

/// Like a driver whose device is the processor: the host reaches the buffers, and plans run when someone waits.
struct Lazy {
  bool is_flushed = false;
  std::int64_t began_ns = 0;
};

class LazyStream final : public Stream {
 public:
  LazyStream(std::unique_ptr<Stream> behind, Lazy& lazy) : behind_(std::move(behind)), lazy_(lazy) {}
  void upload(Buffer& buffer, const void* data, std::size_t bytes) override { behind_->upload(buffer, data, bytes); }
  void download(Buffer& buffer, void* data, std::size_t bytes) override { behind_->download(buffer, data, bytes); }
  void replay(Plan& plan) override {
    plans_.push_back(&plan);
    lazy_.is_flushed = false;
  }
  void flush() override { lazy_.is_flushed = true; }
  std::unique_ptr<Event> record_event() override { return behind_->record_event(); }
  bool finish() override {
    lazy_.began_ns = monotonic_ns();
    for (Plan* plan : plans_) behind_->replay(*plan);
    plans_.clear();
    return behind_->finish();
  }

 private:
  std::unique_ptr<Stream> behind_;
  Lazy& lazy_;
  std::vector<Plan*> plans_;
};

class LazyBackend final : public Backend {
 public:
  explicit LazyBackend(Lazy& lazy) : behind_(open_backend("simd")), lazy_(lazy) {}
  const char* name() const override { return "lazy"; }
  DeviceInfo device() const override { return behind_->device(); }
  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override { return behind_->make_buffer(bytes); }
  std::unique_ptr<Stream> make_stream() override { return std::make_unique<LazyStream>(behind_->make_stream(), lazy_); }
  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override { return behind_->record(steps); }

 private:
  std::unique_ptr<Backend> behind_;
  Lazy& lazy_;
};

TEST(DeviceFrame, IsDoneWhenTheDeviceIsNotWhenTheFrameIsEnqueued) {
  Lazy lazy;
  LazyBackend backend(lazy);
  DetectorConfig config;
  config.window_sides = {208};
  DeviceFrame frame(backend, 640, 480, config);
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
    DeviceFrame frame(*backend, 320, 240, {});
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
