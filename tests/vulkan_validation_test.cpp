// Everything that Berth does with Vulkan, under the Khronos validation layer (core and synchronization checks, and
// GPU-assisted ones where they start): not one message. And what a frame may not do once a detector is made.
#ifdef BERTH_WITH_VULKAN
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/vulkan_hooks.hpp"
#include "vulkan/vulkan.hpp"

namespace berth::vulkan {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// What the validation layer says, from any thread.
class Messages {
 public:
  std::function<void(const std::string&)> listener() {
    return [this](const std::string& message) {
      const std::lock_guard<std::mutex> lock(mutex_);
      all_.push_back(message);
    };
  }
  std::vector<std::string> all() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return all_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> all_;
};

class VulkanValidation : public ::testing::TestWithParam<bool> {
 protected:
  // It leaks, and LeakSanitizer can only leave it alone (support/lsan.supp) while it is loaded.
  static void SetUpTestSuite() { dlopen("libVkLayer_khronos_validation.so", RTLD_NOW | RTLD_NODELETE); }
  void SetUp() override {
    std::string absent;
    if (devices(absent).empty()) GTEST_SKIP() << absent;
    options_.baseline_only = GetParam();
    instruments_.on_message = messages_.listener();
    try {
      const Instance instance(instruments_);
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }
  BackendOptions options_;
  Messages messages_;
  Instruments instruments_;
};
INSTANTIATE_TEST_SUITE_P(Devices, VulkanValidation, ::testing::Bool(), [](const auto& configuration) {
  return configuration.param ? std::string("baseline") : std::string("as_allowed");
});

/// The frame's results and stage digests on that backend and on simd agree.
void expect_the_same_frames(Backend& backend, const std::vector<std::string>& corpora, int frames) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  DetectorConfig config;
  config.digests = true;
  Detector detector(backend, 640, 480, config);
  Detector expected(*simd, 640, 480, config);
  for (const std::string& corpus : corpora) {
    for (int i = 0; i < frames; ++i) {
      const GrayImage image = sim::render(sim::corpus_scene(corpus, 11 * i, 640, 480));
      const FrameResult& found = detector.detect(image.view());
      const FrameResult& wanted = expected.detect(image.view());
      ASSERT_EQ(found.status, wanted.status) << corpus << " " << i;
      ASSERT_EQ(found.detections.size(), wanted.detections.size()) << corpus << " " << i;
      for (std::size_t k = 0; k < wanted.digests.size(); ++k) {
        ASSERT_EQ(found.digests[k].digest, wanted.digests[k].digest)
            << corpus << " " << i << " " << wanted.digests[k].stage;
      }
    }
  }
}

TEST_P(VulkanValidation, IsSilentOverDockingFrames) {
  {
    const std::unique_ptr<Backend> backend = open(options_, instruments_);
    expect_the_same_frames(*backend, {"dock", "cluttered", "dark"}, 3);
  }
  EXPECT_THAT(messages_.all(), IsEmpty());
}

TEST_P(VulkanValidation, IsSilentOverEveryCase) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  {
    const std::unique_ptr<Backend> backend = open(options_, instruments_);
    for (const Op op : all_ops()) {
      for (const cases::OpCase& op_case : cases::cases_for(op)) {
        ASSERT_EQ(
            cases::first_difference(op_case, cases::run_case(op_case, *reference), cases::run_case(op_case, *backend)),
            "");
      }
      ASSERT_THAT(messages_.all(), IsEmpty()) << name_of(op);
    }
  }
  EXPECT_THAT(messages_.all(), IsEmpty());
}

TEST_P(VulkanValidation, IsSilentOverCopiesAndTimes) {
  {
    const std::unique_ptr<Backend> backend = open(options_, instruments_);
    const std::unique_ptr<Buffer> buffer = backend->make_buffer(40000);
    const std::unique_ptr<Plan> plan = backend->record(
        {make_step(scan_params{0, 100}, {buffer.get()}, 1), make_step(scan_params{0, 50}, {buffer.get()}, 1)});
    const std::unique_ptr<Stream> stream = backend->make_stream();
    std::vector<u32> words(10000, 1);
    for (int i = 0; i < 30; ++i) {  // more than a ring and its batches hold
      stream->upload(*buffer, words.data(), 40000);
      stream->replay(*plan);
      stream->replay(*plan);
      stream->download(*buffer, words.data(), 4);
      stream->upload(*buffer, words.data(), 12);
      stream->record_event();
    }
    stream->time_steps(*plan);
    EXPECT_TRUE(stream->finish());
  }
  EXPECT_THAT(messages_.all(), IsEmpty());
}

TEST_P(VulkanValidation, IsSilentWithGpuAssistedChecks) {
  instruments_.gpu_assisted = true;
  {
    const std::unique_ptr<Backend> backend = open(options_, instruments_);
    // The layer says so itself where it cannot do this on a device.
    for (const std::string& message : messages_.all()) {
      if (message.find("GPU-Assisted") != std::string::npos) GTEST_SKIP() << message;
    }
    expect_the_same_frames(*backend, {"easy"}, 2);
  }
  EXPECT_THAT(messages_.all(), IsEmpty());
}

// Without this, silence would prove nothing.
TEST_P(VulkanValidation, NoticesAMissingBarrier) {
  instruments_.adapt = [](Api& api) {
    api.vkCmdPipelineBarrier = [](VkCommandBuffer, VkPipelineStageFlags, VkPipelineStageFlags, VkDependencyFlags,
                                  uint32_t, const VkMemoryBarrier*, uint32_t, const VkBufferMemoryBarrier*, uint32_t,
                                  const VkImageMemoryBarrier*) {};
  };
  {
    const std::unique_ptr<Backend> backend = open(options_, instruments_);
    const std::unique_ptr<Buffer> a = backend->make_buffer(16);
    const std::unique_ptr<Buffer> b = backend->make_buffer(16);
    backend->record({make_step(despeckle_params{1, 1}, {a.get(), b.get()}, 1),
                     make_step(despeckle_params{1, 1}, {b.get(), a.get()}, 1)});
  }
  ASSERT_FALSE(messages_.all().empty());
  EXPECT_THAT(messages_.all()[0], HasSubstr("SYNC-HAZARD"));
}

class VulkanFrames : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Devices, VulkanFrames, ::testing::Bool(), [](const auto& configuration) {
  return configuration.param ? std::string("baseline") : std::string("as_allowed");
});

TEST_P(VulkanFrames, MakeNothingOnceTheDetectorIsMade) {
  std::string absent;
  if (devices(absent).empty()) GTEST_SKIP() << absent;
  static constexpr int kFrames = 12;
  BackendOptions options;
  options.baseline_only = GetParam();
  Instruments instruments;
#define BERTH_MAKING(X)       \
  X(vkAllocateMemory)         \
  X(vkMapMemory)              \
  X(vkCreateBuffer)           \
  X(vkCreateShaderModule)     \
  X(vkCreateComputePipelines) \
  X(vkCreatePipelineLayout)   \
  X(vkCreatePipelineCache)    \
  X(vkCreateDescriptorPool)   \
  X(vkAllocateDescriptorSets) \
  X(vkUpdateDescriptorSets)   \
  X(vkCreateCommandPool)      \
  X(vkAllocateCommandBuffers) \
  X(vkCreateQueryPool)        \
  X(vkCreateFence)            \
  X(vkCmdDispatch)            \
  X(vkCmdPushConstants)
  instruments.adapt = [](Api& api) {
#define X(function) Hook<&Api::function>::install(api);
    BERTH_MAKING(X)
    X(vkQueueSubmit)
#undef X
  };
  const std::unique_ptr<Backend> backend = open(options, instruments);
  Detector detector(*backend, 640, 480, {});
  EXPECT_GT(Hook<&Api::vkAllocateMemory>::calls, 40) << "the hooks see calls";
  EXPECT_EQ(Hook<&Api::vkCmdDispatch>::calls, 46) << "dispatches a frame, see docs/vulkan.md";
  // Upload and plan, then the downloads; the plan alone where the host reaches the buffers.
  const int submissions = backend->make_buffer(4)->host() != nullptr ? 1 : 2;
#define X(function) Hook<& Api::function>::calls = 0;
  BERTH_MAKING(X)
  X(vkQueueSubmit)
#undef X
  std::size_t found = 0;
  for (int i = 0; i < kFrames; ++i) {
    const GrayImage image = sim::render(sim::corpus_scene("dock", 8 * i, 640, 480));
    detector.submit(image.view(), {});
    EXPECT_EQ(Hook<&Api::vkQueueSubmit>::calls, submissions * (i + 1)) << "all at once: no other frame comes between";
    found += detector.collect().detections.size();
  }
  EXPECT_GT(found, 0u);
#define X(function) EXPECT_EQ(Hook<&Api::function>::calls, 0) << #function;
  BERTH_MAKING(X)
#undef X
  EXPECT_EQ(Hook<&Api::vkQueueSubmit>::calls, submissions * kFrames) << "nothing is left for the one who waits";
}

}  // namespace
}  // namespace berth::vulkan
#endif
