// Every backend with a device loses it, or finds it hanging, under a stream of 300 frames/s: each frame has its result,
// in order and with the same bits, and a backend that was opened anew is gone back to.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <thread>

#include "berth/pipeline.hpp"
#include "support/pipeline_frames.hpp"
#ifdef BERTH_WITH_CUDA
#include "fake_cuda/fake_driver.hpp"
#endif
#ifdef BERTH_WITH_VULKAN
#include "support/vulkan_hooks.hpp"
#include "vulkan/vulkan.hpp"
#endif

namespace berth {
namespace {

using namespace test::pipeline;

constexpr u64 kFrames = 60, kFailsAt = 20;
constexpr std::int64_t kHangNs = 700'000'000;

/// A device, and how it fails. Its backend is opened by `open`.
struct Faulty {
  std::function<std::unique_ptr<Backend>()> open;
  std::function<void()> lose, hang, mend;
};

/// Flies kFrames past the device, which fails after the frame kFailsAt.
void fly(const Faulty& device, const std::function<void()>& fail, const char* reason) {
  const std::unique_ptr<Backend> first = device.open();
  const std::unique_ptr<Backend> second = open_backend("simd");
  PipelineConfig config;
  config.detector = posing();
  config.overrun = Overrun::wait;
  config.hang_ns = kHangNs;
  config.health.emplace().known_answer_every_ns = 0;
  Judge judge(config.detector);
  u64 others = 0;
  Pipeline pipeline({first.get(), second.get()}, kWidth, kHeight, config, [&](const PipelineFrame& frame) {
    judge(frame);
    others += frame.backend == 1 ? 1 : 0;
    if (frame.result->stamp.sequence == kFailsAt) fail();
  });
  ASSERT_EQ(pipeline.health().mode, HealthMode::nominal);
  pipeline.start();
  auto due = std::chrono::steady_clock::now();
  for (u64 i = 0; i < kFrames; ++i) {
    std::this_thread::sleep_until(due);
    due += std::chrono::microseconds(3333);
    EXPECT_TRUE(pipeline.push(picture(i), stamped(i)));
  }
  pipeline.stop();
  device.mend();
  const PipelineCounts counts = pipeline.counts();
  EXPECT_EQ(judge.seen(), kFrames);
  EXPECT_EQ(counts.delivered, kFrames);
  EXPECT_EQ(counts.all_dropped() + counts.device_lost, 0u);
  // What was in flight on the device then; results had gone out up to the frame before.
  EXPECT_GE(counts.run_again, 1u);
  EXPECT_LE(counts.run_again, static_cast<u64>(config.slots));
  EXPECT_GE(others, kFrames - kFailsAt - 1 - static_cast<u64>(config.slots));
  EXPECT_EQ(pipeline.health().mode, HealthMode::fallback);
  EXPECT_STREQ(pipeline.health().reason, reason);
}

// Of every backend that was built; there may be none.
[[maybe_unused]] void fly_both(const Faulty& device) {
  {
    SCOPED_TRACE("lost");
    fly(device, device.lose, "its device was lost");
  }
  {
    SCOPED_TRACE("hangs");
    fly(device, device.hang, "its device hangs");
  }
}

#ifdef BERTH_WITH_CUDA
TEST(DeviceFailure, OfCudaCostsNoFrame) {
  FakeDriver driver("current");
  fly_both({[] { return open_backend("cuda"); }, [&] { driver.fake_cuda_lose_at_kernel(1); },
            [&] { driver.fake_cuda_hold(true); },
            [&] {
              driver.fake_cuda_hold(false);
              driver.fake_cuda_reset();
            }});
}
#endif

#ifdef BERTH_WITH_VULKAN
/// Waits for fences that last until they are told.
struct HeldFences {
  static inline std::mutex mutex;
  static inline std::condition_variable changed;
  static inline bool held = false;
  static inline PFN_vkWaitForFences real = nullptr;
  static void hold(bool hold_now) {
    const std::lock_guard<std::mutex> lock(mutex);
    held = hold_now;
    changed.notify_all();
  }
  static VkResult wait(VkDevice device, uint32_t count, const VkFence* fences, VkBool32 all, uint64_t timeout) {
    {
      std::unique_lock<std::mutex> lock(mutex);
      changed.wait(lock, [] { return !held; });
    }
    return real(device, count, fences, all, timeout);
  }
};

TEST(DeviceFailure, OfVulkanCostsNoFrame) {
  using Submit = vulkan::Hook<&vulkan::Api::vkQueueSubmit>;
  std::string absent;
  if (vulkan::devices(absent).empty()) GTEST_SKIP() << absent;
  vulkan::Instruments instruments;
  instruments.adapt = [](vulkan::Api& api) {
    Submit::install(api);
    HeldFences::real = api.vkWaitForFences;
    api.vkWaitForFences = &HeldFences::wait;
  };
  fly_both({[&] { return vulkan::open({}, instruments); }, [] { Submit::fail_after(0, VK_ERROR_DEVICE_LOST); },
            [] { HeldFences::hold(true); },
            [] {
              HeldFences::hold(false);
              Submit::fail_after(-1, VK_SUCCESS);
            }});
}
#endif

#ifdef BERTH_FAILING_OPENCL
TEST(DeviceFailure, OfOpenclCostsNoFrame) {
  setenv("BERTH_OPENCL_LIBRARY", BERTH_FAILING_OPENCL, 1);
  void* const library = dlopen(BERTH_FAILING_OPENCL, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  ASSERT_NE(library, nullptr) << dlerror();
  const auto control = [&](const char* name) { return reinterpret_cast<void (*)(int)>(dlsym(library, name)); };
  void (*const lose)(int) = control("failing_opencl_lose");
  void (*const hold)(int) = control("failing_opencl_hold");
  for (const BackendStatus& status : probe_backends()) {
    if (status.name == "opencl" && status.devices.empty()) GTEST_SKIP() << status.absent;
  }
  fly_both({[] { return open_backend("opencl"); }, [&] { lose(1); }, [&] { hold(1); },
            [&] {
              lose(0);
              hold(0);
            }});
}
#endif

}  // namespace
}  // namespace berth
