// When Vulkan's calls fail: at start an Error that says what and why, on a running stream a lost device; and the file
// of compiled pipelines, which may be missing, damaged or someone else's.
#ifdef BERTH_WITH_VULKAN
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "support/command_run.hpp"
#include "support/pictures.hpp"
#include "support/vulkan_hooks.hpp"
#include "vulkan/pipeline_cache.hpp"
#include "vulkan/vulkan.hpp"

namespace berth::vulkan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class VulkanFailure : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    std::string absent;
    if (devices(absent).empty()) GTEST_SKIP() << absent;
    options_.baseline_only = GetParam();
    options_.cache_dir = folder_.path();
  }
  /// What opening the backend and making a detector on it says, with these hooks in place.
  std::string start(const std::function<void(Api&)>& adapt) {
    Instruments instruments;
    instruments.adapt = adapt;
    try {
      const std::unique_ptr<Backend> backend = open(options_, instruments);
      Detector(*backend, 64, 48, {});
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  }
  template <auto Member>
  std::string start_failing(int good, VkResult result) {
    return start([&](Api& api) {
      Hook<Member>::install(api);
      Hook<Member>::fail_after(good, result);
    });
  }
  test::ScratchFolder folder_;
  BackendOptions options_;
};
INSTANTIATE_TEST_SUITE_P(Devices, VulkanFailure, ::testing::Bool(), [](const auto& configuration) {
  return configuration.param ? std::string("baseline") : std::string("as_allowed");
});

TEST_P(VulkanFailure, AtStartIsAnErrorThatSaysWhat) {
  EXPECT_EQ(start([](Api&) {}), "no error");
  const std::string memory = start_failing<&Api::vkAllocateMemory>(3, VK_ERROR_OUT_OF_DEVICE_MEMORY);
  EXPECT_THAT(memory, AllOf(HasSubstr("vulkan: a buffer of "), HasSubstr("failed (-2 VK_ERROR_OUT_OF_DEVICE_MEMORY)"),
                            HasSubstr("; free some memory")));
  EXPECT_THAT(start_failing<&Api::vkCreateBuffer>(0, VK_ERROR_OUT_OF_HOST_MEMORY),
              HasSubstr("a buffer of 3072 bytes on "));
  EXPECT_THAT(start_failing<&Api::vkBindBufferMemory>(1, VK_ERROR_OUT_OF_DEVICE_MEMORY), HasSubstr("a buffer of "));
  EXPECT_THAT(start_failing<&Api::vkMapMemory>(0, VK_ERROR_MEMORY_MAP_FAILED), HasSubstr("VK_ERROR_MEMORY_MAP_FAILED"));
  EXPECT_THAT(start_failing<&Api::vkCreateComputePipelines>(2, VK_ERROR_OUT_OF_HOST_MEMORY),
              HasSubstr("building the kernel tile_extrema for "));
  EXPECT_THAT(start_failing<&Api::vkCreateShaderModule>(0, VK_ERROR_INVALID_SHADER_NV),
              AllOf(HasSubstr("building the kernel flat_field for "), HasSubstr("; update the driver")));
  EXPECT_THAT(start_failing<&Api::vkCreateDescriptorPool>(0, VK_ERROR_OUT_OF_HOST_MEMORY), HasSubstr("descriptors"));
  EXPECT_THAT(start_failing<&Api::vkAllocateDescriptorSets>(5, VK_ERROR_OUT_OF_POOL_MEMORY), HasSubstr("descriptors"));
  EXPECT_THAT(start_failing<&Api::vkCreateFence>(0, VK_ERROR_OUT_OF_HOST_MEMORY), HasSubstr("making a fence"));
  EXPECT_THAT(start_failing<&Api::vkCreateCommandPool>(0, VK_ERROR_OUT_OF_HOST_MEMORY), HasSubstr("a command pool"));
  EXPECT_THAT(start_failing<&Api::vkEndCommandBuffer>(GetParam() ? 1000 : 0, VK_ERROR_OUT_OF_HOST_MEMORY),
              GetParam() ? HasSubstr("no error") : HasSubstr("recording a plan"));
  EXPECT_THAT(start_failing<&Api::vkCreatePipelineCache>(0, VK_ERROR_OUT_OF_HOST_MEMORY),
              HasSubstr("making the pipeline cache"));
}

TEST_P(VulkanFailure, OfTheDeviceEndsAStreamForGood) {
  Instruments instruments;
  instruments.adapt = [](Api& api) {
    Hook<&Api::vkQueueSubmit>::install(api);
    Hook<&Api::vkWaitForFences>::install(api);
    Hook<&Api::vkBeginCommandBuffer>::install(api);
    Hook<&Api::vkEndCommandBuffer>::install(api);
    Hook<&Api::vkResetFences>::install(api);
  };
  const std::unique_ptr<Backend> backend = open(options_, instruments);
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(16);
  const std::unique_ptr<Plan> plan = backend->record({make_step(scan_params{0, 3}, {buffer.get()}, 1)});
  u32 words[4] = {1, 1, 1, 0};
  const auto survives = [&](const auto& fail, const auto& mend) {
    const std::unique_ptr<Stream> stream = backend->make_stream();
    stream->upload(*buffer, words, 16);
    stream->replay(*plan);
    EXPECT_TRUE(stream->finish());
    fail();
    stream->upload(*buffer, words, 16);
    stream->replay(*plan);
    stream->download(*buffer, words, 16);
    const std::unique_ptr<Event> event = stream->record_event();
    const bool waited = event->wait();
    const bool finished = stream->finish();
    mend();
    EXPECT_EQ(waited, finished);
    stream->upload(*buffer, words, 16);
    stream->replay(*plan);
    const bool later = stream->finish();
    EXPECT_EQ(finished, later) << "a lost stream stays lost";
    EXPECT_EQ(stream->record_event()->wait(), later);
    EXPECT_EQ(stream->time_steps(*plan).empty(), !later);
    return finished;
  };
  const auto lost_by = [&](auto hook, VkResult result) {
    return !survives([&] { decltype(hook)::fail_after(0, result); }, [&] { decltype(hook)::fail_after(-1, result); });
  };
  EXPECT_TRUE(survives([] {}, [] {}));
  EXPECT_TRUE(lost_by(Hook<&Api::vkQueueSubmit>(), VK_ERROR_DEVICE_LOST));
  EXPECT_TRUE(lost_by(Hook<&Api::vkQueueSubmit>(), VK_ERROR_OUT_OF_DEVICE_MEMORY));
  EXPECT_TRUE(lost_by(Hook<&Api::vkBeginCommandBuffer>(), VK_ERROR_OUT_OF_HOST_MEMORY));
  EXPECT_TRUE(lost_by(Hook<&Api::vkEndCommandBuffer>(), VK_ERROR_OUT_OF_HOST_MEMORY));
  EXPECT_TRUE(lost_by(Hook<&Api::vkResetFences>(), VK_ERROR_OUT_OF_DEVICE_MEMORY));
  // Last: what is pretended to be lost is still at work when its stream goes.
  EXPECT_TRUE(lost_by(Hook<&Api::vkWaitForFences>(), VK_ERROR_DEVICE_LOST));
  ASSERT_TRUE(backend->make_stream()->finish()) << "another stream of the same device";
}

TEST_P(VulkanFailure, OfTheDeviceIsTheFramesStatus) {
  Instruments instruments;
  instruments.adapt = [](Api& api) { Hook<&Api::vkQueueSubmit>::install(api); };
  const std::unique_ptr<Backend> backend = open(options_, instruments);
  const GrayImage image = pictures::quads(97, 61, 4, 2, 12);
  Detector detector(*backend, 97, 61, {});
  EXPECT_NE(detector.detect(image.view()).status, FrameStatus::device_lost);
  Hook<&Api::vkQueueSubmit>::fail_after(0, VK_ERROR_DEVICE_LOST);
  EXPECT_EQ(detector.detect(image.view()).status, FrameStatus::device_lost);
  Hook<&Api::vkQueueSubmit>::fail_after(-1, VK_SUCCESS);
  EXPECT_EQ(detector.detect(image.view()).status, FrameStatus::device_lost);
}

/// What the driver was given to start from when the backend opened, bytes; and the files in the cache folder.
class VulkanCache : public VulkanFailure {
 protected:
  std::size_t bytes_from_cache() {
    static PFN_vkCreatePipelineCache real = nullptr;
    static std::size_t bytes = 0;
    bytes = 12345678;
    Instruments instruments;
    instruments.adapt = [](Api& api) {
      real = api.vkCreatePipelineCache;
      api.vkCreatePipelineCache = [](VkDevice device, const VkPipelineCacheCreateInfo* info,
                                     const VkAllocationCallbacks* allocator, VkPipelineCache* cache) {
        bytes = info->initialDataSize;
        return real(device, info, allocator, cache);
      };
    };
    open(options_, instruments);
    return bytes;
  }
  std::vector<std::string> files() const {
    std::vector<std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator(options_.cache_dir)) all.push_back(entry.path());
    return all;
  }
  static std::string read(const std::string& path) { return test::text_of(path); }
  static void write(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }
};
INSTANTIATE_TEST_SUITE_P(Devices, VulkanCache, ::testing::Values(false), [](const auto&) { return "as_allowed"; });

TEST_P(VulkanCache, IsWrittenOnceAndReadThen) {
  options_.cache_dir = folder_ / "deep/er";
  EXPECT_EQ(bytes_from_cache(), 0u);
  ASSERT_EQ(files().size(), 1u) << "no temporary file is left";
  const std::string kept = read(files()[0]);
  EXPECT_EQ(kept.substr(0, 15), "berth vulkan 1\n");
  EXPECT_EQ(bytes_from_cache(), kept.size() - 19);
  EXPECT_EQ(files().size(), 1u);
}

TEST_P(VulkanCache, ReplacesADamagedFile) {
  bytes_from_cache();
  const std::string path = files().at(0);
  const std::string kept = read(path);
  for (std::size_t at = 0; at < kept.size(); at += 1 + kept.size() / 40) {
    std::string damaged = kept;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    write(path, damaged);
    EXPECT_EQ(bytes_from_cache(), 0u) << "byte " << at;
    EXPECT_EQ(read(path), kept) << "byte " << at;
  }
  for (const std::size_t size : {std::size_t{0}, std::size_t{10}, std::size_t{19}, kept.size() - 1}) {
    write(path, kept.substr(0, size));
    EXPECT_EQ(bytes_from_cache(), 0u) << "cut to " << size;
    EXPECT_EQ(read(path), kept);
  }
}

VkPhysicalDeviceProperties some_device() {
  VkPhysicalDeviceProperties device = {};
  device.vendorID = 0x10de;
  device.deviceID = 0x2684;
  for (std::size_t i = 0; i < VK_UUID_SIZE; ++i) device.pipelineCacheUUID[i] = static_cast<uint8_t>(i * 17);
  return device;
}
std::vector<unsigned char> data_for(const VkPhysicalDeviceProperties& device) {
  VkPipelineCacheHeaderVersionOne header = {};
  header.headerSize = sizeof header;
  header.headerVersion = VK_PIPELINE_CACHE_HEADER_VERSION_ONE;
  header.vendorID = device.vendorID;
  header.deviceID = device.deviceID;
  std::copy(std::begin(device.pipelineCacheUUID), std::end(device.pipelineCacheUUID), header.pipelineCacheUUID);
  const auto* bytes = reinterpret_cast<const unsigned char*>(&header);
  return {bytes, bytes + sizeof header};
}

TEST(VulkanCacheFile, IsOnlyForTheDriverThatWroteIt) {
  const test::ScratchFolder folder;
  const VkPhysicalDeviceProperties device = some_device();
  VkPhysicalDeviceProperties updated = device;
  updated.pipelineCacheUUID[3] ^= 1;
  const PipelineCache mine(folder.path(), device);
  const PipelineCache its(folder.path(), updated);
  EXPECT_NE(mine.path(), its.path());
  EXPECT_TRUE(mine.load().empty());
  ASSERT_TRUE(mine.store(data_for(device)));
  EXPECT_EQ(mine.load(), data_for(device));
  ASSERT_TRUE(mine.store(data_for(updated)));
  EXPECT_TRUE(mine.load().empty()) << "whole, but another driver's";
}

TEST(VulkanCacheFile, MayHaveNoPlace) {
  const test::ScratchFolder folder;
  folder.write("file", std::string("x"));
  for (const std::string& where : {std::string(), folder / "file", folder / "file/below", std::string("/proc/berth")}) {
    const PipelineCache cache(where, some_device());
    EXPECT_FALSE(cache.store(data_for(some_device()))) << where;
    EXPECT_TRUE(cache.load().empty()) << where;
  }
  const PipelineCache cache(folder.path(), some_device());
  std::filesystem::create_directories(cache.path());  // a folder where the file should be
  EXPECT_FALSE(cache.store(data_for(some_device())));
  EXPECT_TRUE(cache.load().empty());
}

}  // namespace
}  // namespace berth::vulkan
#endif
