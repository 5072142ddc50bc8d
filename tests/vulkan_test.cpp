// What is special to the Vulkan backend: finding devices, saying why there is none, copies, plans and streams.
// That its kernels compute the reference's bits is conformance_test's business; whole frames in both configurations are
// in vulkan_validation_test, failures in vulkan_failure_test.
#ifdef BERTH_WITH_VULKAN
#include "vulkan/vulkan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <numeric>
#include <thread>

#include "berth/error.hpp"
#include "support/command_run.hpp"
#include "support/op_case.hpp"
#include "support/vulkan_hooks.hpp"
#include "vulkan/devices.hpp"
#include "vulkan/staging.hpp"

namespace berth::vulkan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

template <class Action>
std::string error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(VulkanDevices, AreChosenByIndexOrPartOfTheName) {
  std::vector<Device> devices(3);
  devices[0].name = "NVIDIA RTX 3090";
  devices[1].name = "V3D 7.1";
  devices[2].name = "llvmpipe (LLVM 15.0.6, 256 bits)";
  EXPECT_EQ(choose_device(devices, ""), 0u);
  EXPECT_EQ(choose_device(devices, "2"), 2u);
  EXPECT_EQ(choose_device(devices, "LLVMpipe"), 2u);
  EXPECT_EQ(choose_device(devices, "3090"), 0u) << "no such index, but a part of a name";
  EXPECT_THAT(error_of([&] { choose_device(devices, "intel"); }),
              AllOf(StartsWith("vulkan: no device 'intel'"), HasSubstr("0: NVIDIA RTX 3090"),
                    HasSubstr("2: llvmpipe (LLVM 15.0.6, 256 bits)")));
  EXPECT_THAT(error_of([&] { choose_device(devices, "123456789012345678901"); }), HasSubstr("no device"));
}

TEST(VulkanDevices, MustBeAbleToRunTheKernels) {
  // What Vulkan promises, and one buffer more.
  const Abilities good{VK_API_VERSION_1_1, true, 128, 128, 16384, 5};
  EXPECT_EQ(shortcoming(good), "");
  const auto without = [&](const auto& change) {
    Abilities poor = good;
    change(poor);
    return shortcoming(poor);
  };
  EXPECT_THAT(without([](Abilities& a) { a.version = VK_API_VERSION_1_0; }), HasSubstr("Vulkan 1.0, not 1.1"));
  EXPECT_THAT(without([](Abilities& a) { a.computes = false; }), HasSubstr("no compute queue"));
  EXPECT_THAT(without([](Abilities& a) { a.group_items = 64; }), HasSubstr("at most 64 work-items, not 128"));
  EXPECT_THAT(without([](Abilities& a) { a.group_width = 1; }), HasSubstr("at most 1 work-items, not 128"));
  EXPECT_THAT(without([](Abilities& a) { a.shared_bytes = 8192; }), HasSubstr("8192 bytes, not 16384"));
  EXPECT_THAT(without([](Abilities& a) { a.buffers = 4; }), HasSubstr("at most 4 buffers, not 5"));
}

// What a process sees whose environment was different from its start: the loader reads it once.
TEST(VulkanChild, DISABLED_SaysWhatIsThere) {
  std::string absent;
  const std::vector<DeviceInfo> found = devices(absent);
  std::printf("child: %zu devices\nchild: %s\nchild: %s\n", found.size(), absent.c_str(),
              error_of([] { open({}); }).c_str());
  const test::CommandRun doctor = test::run_berth({"doctor"});
  std::printf("child: doctor %s\n", doctor.out.find(absent) != std::string::npos ? "says so" : "does not say so");
}

std::string child_with(const std::string& variables) {
  char self[4096] = {};
  if (readlink("/proc/self/exe", self, sizeof self - 1) < 0) return "no /proc";
  const std::string command = "env " + variables + " '" + self +
                              "' --gtest_also_run_disabled_tests --gtest_filter=VulkanChild.DISABLED_SaysWhatIsThere";
  std::FILE* output = popen(command.c_str(), "r");
  std::string said;
  char line[4096];
  while (std::fgets(line, sizeof line, output) != nullptr) {
    if (std::string(line).compare(0, 7, "child: ") == 0) said += std::string(line).substr(7);
  }
  EXPECT_EQ(pclose(output), 0) << command;
  return said;
}

/// The reason that devices() gives and the one open() throws are the same, end in a remedy, and doctor shows them.
void expect_absent(const std::string& said, const std::string& reason) {
  EXPECT_THAT(said, AllOf(StartsWith("0 devices\nvulkan: "), HasSubstr(reason), HasSubstr("; ")));
  const std::size_t first = said.find('\n') + 1;
  const std::size_t second = said.find('\n', first) + 1;
  const std::size_t third = said.find('\n', second) + 1;
  EXPECT_EQ(said.substr(first, second - first), said.substr(second, third - second));
  EXPECT_EQ(said.substr(third), "doctor says so\n");
}

TEST(VulkanAbsence, OfTheLoaderIsExplained) {
  expect_absent(child_with("BERTH_VULKAN_LIBRARY=/nowhere/libvulkan.so.1"),
                "BERTH_VULKAN_LIBRARY cannot be opened (/nowhere/libvulkan.so.1");
}

TEST(VulkanAbsence, OfItsFunctionsIsExplained) {
  expect_absent(child_with("BERTH_VULKAN_LIBRARY=libc.so.6"), "libc.so.6 lacks vkGetInstanceProcAddr of Vulkan 1.1");
}

TEST(VulkanAbsence, OfDriversIsExplained) {
  std::string absent;
  if (devices(absent).empty() && absent.find("no Vulkan loader") != std::string::npos) GTEST_SKIP() << absent;
  const std::string said = child_with("VK_DRIVER_FILES=/nowhere/icd.json VK_ICD_FILENAMES=/nowhere/icd.json");
  expect_absent(said, "the loader finds no driver in VK_DRIVER_FILES=/nowhere/icd.json");
  EXPECT_THAT(said, HasSubstr("apt install mesa-vulkan-drivers"));
}

TEST(VulkanStaging, GivesRoomInTurnAndTakesItBackInTurn) {
  StagingRing ring({}, 64);
  EXPECT_EQ(ring.take(65), StagingRing::kNoRoom);
  EXPECT_EQ(ring.take(20), 0u);
  EXPECT_EQ(ring.take(16), 32u);
  const std::size_t first = ring.mark();
  EXPECT_EQ(first, 48u);
  EXPECT_EQ(ring.take(17), StagingRing::kNoRoom) << "16 are left";
  EXPECT_EQ(ring.take(1), 48u);
  const std::size_t second = ring.mark();
  ring.give_back(first);
  EXPECT_EQ(ring.take(33), 0u) << "48 are free before the last 16";
  const std::size_t third = ring.mark();
  EXPECT_EQ(ring.take(1), StagingRing::kNoRoom);
  ring.give_back(second);
  EXPECT_EQ(ring.take(16), 48u);
  const std::size_t fourth = ring.mark();
  ring.give_back(third);
  ring.give_back(fourth);
  EXPECT_EQ(ring.take(64), 0u) << "an empty ring begins anew";
}

TEST(VulkanStaging, CountsTheGapAtTheEnd) {
  StagingRing ring({}, 64);
  EXPECT_EQ(ring.take(32), 0u);
  const std::size_t first = ring.mark();
  EXPECT_EQ(ring.take(16), 32u);
  const std::size_t second = ring.mark();
  ring.give_back(first);
  EXPECT_EQ(ring.take(32), 0u) << "not over the end";
  const std::size_t third = ring.mark();
  EXPECT_EQ(third, 48u) << "with the 16 left out there";
  EXPECT_EQ(ring.take(16), StagingRing::kNoRoom);
  ring.give_back(second);
  EXPECT_EQ(ring.take(16), 32u);
  const std::size_t fourth = ring.mark();
  EXPECT_EQ(ring.take(16), StagingRing::kNoRoom) << "the gap goes with what came after it";
  ring.give_back(third);
  EXPECT_EQ(ring.take(16), 48u);
  ring.give_back(fourth);
  ring.give_back(ring.mark());
  EXPECT_EQ(ring.take(64), 0u);
}

/// In every configuration: as the device allows, and as every device must.
class VulkanBackend : public ::testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    std::string absent;
    if (devices(absent).empty()) GTEST_SKIP() << absent;
    options_.baseline_only = GetParam();
  }
  BackendOptions options_;
};
INSTANTIATE_TEST_SUITE_P(Devices, VulkanBackend, ::testing::Bool(), [](const auto& configuration) {
  return configuration.param ? std::string("baseline") : std::string("as_allowed");
});

TEST_P(VulkanBackend, OpensTheDeviceThatIsListed) {
  std::string absent = "stale";
  const std::vector<DeviceInfo> found = devices(absent);
  EXPECT_EQ(absent, "");
  options_.device = std::to_string(found.size() - 1);
  const std::unique_ptr<Backend> backend = open(options_);
  EXPECT_STREQ(backend->name(), "vulkan");
  EXPECT_EQ(backend->device().name, found.back().name);
  EXPECT_EQ(backend->device().driver, found.back().driver);
  EXPECT_NE(found.back().driver, "");
  options_.device = "no such device";
  EXPECT_THAT(error_of([&] { open(options_); }), AllOf(HasSubstr("'no such device'"), HasSubstr(found[0].name)));
}

TEST_P(VulkanBackend, MakesBuffersOfZeros) {
  const std::unique_ptr<Backend> backend = open(options_);
  const std::unique_ptr<Stream> stream = backend->make_stream();
  for (const std::size_t bytes : {1u, 4u, 1001u, 100000u}) {
    const std::unique_ptr<Buffer> buffer = backend->make_buffer(bytes);
    EXPECT_EQ(buffer->bytes(), bytes);
    if (GetParam()) {
      EXPECT_EQ(buffer->host(), nullptr);
    }
    std::vector<u8> read(bytes, 0xee);
    stream->download(*buffer, read.data(), bytes);
    ASSERT_TRUE(stream->finish());
    EXPECT_EQ(read, std::vector<u8>(bytes, 0));
  }
  const std::unique_ptr<Buffer> empty = backend->make_buffer(0);
  stream->upload(*empty, nullptr, 0);
  stream->download(*empty, nullptr, 0);
  EXPECT_TRUE(stream->finish());
  EXPECT_THAT(error_of([&] { backend->make_buffer(std::size_t{1} << 60); }),
              AllOf(StartsWith("vulkan: a buffer of 1152921504606846976 bytes on "), HasSubstr("above its limit")));
}

TEST_P(VulkanBackend, CopiesTheFirstBytesInOrder) {
  const std::unique_ptr<Backend> backend = open(options_);
  const std::unique_ptr<Stream> stream = backend->make_stream();
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(8);
  const std::vector<u8> all = {1, 2, 3, 4, 5, 6, 7, 8};
  const std::vector<u8> some = {9, 10, 11};
  std::vector<u8> before(8), after(8), part(2);
  stream->upload(*buffer, all.data(), 8);
  stream->download(*buffer, before.data(), 8);
  stream->upload(*buffer, some.data(), 3);
  stream->download(*buffer, after.data(), 8);
  stream->download(*buffer, part.data(), 2);
  const std::unique_ptr<Event> event = stream->record_event();
  ASSERT_TRUE(event->wait());
  EXPECT_TRUE(event->wait()) << "once more";
  EXPECT_EQ(before, all);
  EXPECT_EQ(after, (std::vector<u8>{9, 10, 11, 4, 5, 6, 7, 8}));
  EXPECT_EQ(part, (std::vector<u8>{9, 10}));
}

TEST_P(VulkanBackend, CopiesMoreThanItsRingHoldsAtOnce) {
  const std::unique_ptr<Backend> backend = open(options_);
  const std::unique_ptr<Stream> stream = backend->make_stream();  // its ring is small: there is no buffer yet
  constexpr std::size_t kWords = 12345;
  const std::unique_ptr<Buffer> small = backend->make_buffer(kWords * 4);
  const std::unique_ptr<Buffer> large = backend->make_buffer(kWords * 40);
  std::vector<std::vector<u32>> sent(20, std::vector<u32>(kWords)), got = sent;
  for (u32 i = 0; i < sent.size(); ++i) {  // far more copies than batches, and than fit the ring
    std::iota(sent[i].begin(), sent[i].end(), i * 1000000);
    stream->upload(*small, sent[i].data(), kWords * 4);
    stream->download(*small, got[i].data(), kWords * 4);
    stream->record_event();
  }
  std::vector<u32> much(kWords * 10), much_got(kWords * 10);
  std::iota(much.begin(), much.end(), 7);
  stream->upload(*large, much.data(), kWords * 40);
  stream->download(*large, much_got.data(), kWords * 40);
  ASSERT_TRUE(stream->finish());
  EXPECT_EQ(got, sent);
  EXPECT_EQ(much_got, much);
}

TEST_P(VulkanBackend, RefusesStepsItCannotRun) {
  const std::unique_ptr<Backend> backend = open(options_);
  const std::unique_ptr<Backend> other = open(options_);
  const std::unique_ptr<Backend> host = open_backend("reference");
  const std::unique_ptr<Buffer> mine = backend->make_buffer(64);
  const std::unique_ptr<Buffer> its = other->make_buffer(64);
  const std::unique_ptr<Buffer> hosts = host->make_buffer(64);
  const scan_params params{0, 3};
  EXPECT_NE(backend->record({make_step(params, {mine.get()}, 128)}), nullptr);
  EXPECT_THAT(error_of([&] { backend->record({make_step(params, {its.get()}, 128)}); }),
              HasSubstr("an argument of scan is not a buffer of this backend"));
  EXPECT_THAT(error_of([&] { backend->record({make_step(params, {hosts.get()}, 128)}); }),
              HasSubstr("not a buffer of this backend"));
  Step short_of_params = make_step(params, {mine.get()}, 128);
  short_of_params.params.pop_back();
  EXPECT_THAT(error_of([&] { backend->record({short_of_params}); }), HasSubstr("scan is missing"));
  Step short_of_buffers = make_step(params, {mine.get()}, 128);
  short_of_buffers.buffers.clear();
  EXPECT_THAT(error_of([&] { backend->record({short_of_buffers}); }), HasSubstr("scan is missing"));
}

TEST_P(VulkanBackend, ReplaysAPlanAsOftenAsAsked) {
  const std::unique_ptr<Backend> backend = open(options_);
  const std::unique_ptr<Stream> stream = backend->make_stream();
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(20 * 4);
  // Not launched: no items. Each run sums once more: 1 1 1 … 1 → 0 1 2 … | 19 → 0 0 1 3 6 …
  const std::unique_ptr<Plan> plan = backend->record(
      {make_step(scan_params{0, 19}, {buffer.get()}, 0), make_step(scan_params{0, 19}, {buffer.get()}, 1)});
  const std::unique_ptr<Plan> empty = backend->record({});
  std::vector<u32> expected(20, 1), result(20);
  stream->upload(*buffer, expected.data(), 80);
  for (int i = 0; i < 12; ++i) {  // more than there are batches, with nothing waited for between
    stream->replay(*plan);
    stream->replay(*empty);
    u32 sum = 0;
    for (std::size_t k = 0; k < 19; ++k) sum += std::exchange(expected[k], sum);
    expected[19] = sum;
  }
  stream->download(*buffer, result.data(), 80);
  ASSERT_TRUE(stream->finish());
  EXPECT_EQ(result, expected);
}

TEST_P(VulkanBackend, PutsBarriersOnlyBetweenStepsThatDependOnEachOther) {
  Instruments instruments;
  instruments.adapt = [](Api& api) { Hook<&Api::vkCmdPipelineBarrier>::install(api); };
  const std::unique_ptr<Backend> backend = open(options_, instruments);
  const std::unique_ptr<Buffer> a = backend->make_buffer(4096);
  const std::unique_ptr<Buffer> b = backend->make_buffer(4096);
  const std::unique_ptr<Buffer> c = backend->make_buffer(4096);
  const auto barriers = [&](const std::vector<Step>& steps) {
    const int before = Hook<&Api::vkCmdPipelineBarrier>::calls;
    backend->record(steps);
    return Hook<&Api::vkCmdPipelineBarrier>::calls - before;
  };
  const auto scan = [](Buffer& values) { return make_step(scan_params{0, 3}, {&values}, 1); };
  const auto clean = [](Buffer& from, Buffer& to) { return make_step(despeckle_params{1, 1}, {&from, &to}, 1); };
  const int none = barriers({});
  EXPECT_EQ(barriers({scan(*a), scan(*b), scan(*c)}), none) << "nothing in common";
  EXPECT_EQ(barriers({clean(*a, *b), clean(*a, *c)}), none) << "both only read a";
  EXPECT_EQ(barriers({scan(*a), scan(*a)}), none + 1) << "written twice";
  EXPECT_EQ(barriers({clean(*a, *b), clean(*b, *c)}), none + 1) << "read after written";
  EXPECT_EQ(barriers({clean(*a, *b), scan(*a)}), none + 1) << "written after read";
  EXPECT_EQ(barriers({scan(*a), scan(*a), scan(*b), scan(*b)}), none + 1) << "one for both";
  EXPECT_EQ(barriers({clean(*a, *b), clean(*a, *c), scan(*a), clean(*a, *b)}), none + 2);
}

TEST_P(VulkanBackend, TellsHowLongEachStepTakes) {
  const std::unique_ptr<Backend> backend = open(options_);
  const std::unique_ptr<Stream> stream = backend->make_stream();
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(400004);
  const std::unique_ptr<Plan> plan = backend->record({make_step(scan_params{0, 100000}, {buffer.get()}, 1),
                                                      make_step(scan_params{0, 1}, {buffer.get()}, 0),
                                                      make_step(scan_params{0, 100000}, {buffer.get()}, 1)});
  const std::vector<std::int64_t> times = stream->time_steps(*plan);
  if (times.empty()) GTEST_SKIP() << backend->device().name << " has no timestamps";
  ASSERT_EQ(times.size(), 3u);
  EXPECT_GT(times[0], 1000);
  EXPECT_EQ(times[1], 0);
  EXPECT_GT(times[2], 1000);
  EXPECT_TRUE(stream->time_steps(*backend->record({})).empty());
}

TEST_P(VulkanBackend, SharesADeviceBetweenThreads) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const std::unique_ptr<Backend> shared = open(options_);
  const std::vector<cases::OpCase> all = cases::cases_for(Op::run_link);
  std::vector<std::thread> threads;
  std::vector<std::string> differences(4);
  for (std::size_t i = 0; i < differences.size(); ++i) {
    threads.emplace_back([&, i] {
      // Two threads with a backend of their own, two with streams of one.
      const std::unique_ptr<Backend> own = i % 2 == 0 ? open(options_) : nullptr;
      for (std::size_t k = i; k < all.size() && differences[i].empty(); k += 2) {
        differences[i] = cases::first_difference(all[k], cases::run_case(all[k], *reference),
                                                 cases::run_case(all[k], own != nullptr ? *own : *shared));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(differences, std::vector<std::string>(4));
}

}  // namespace
}  // namespace berth::vulkan
#endif
