// What is special to the OpenCL backend: finding devices, saying why there is none, setting up, and losing a device.
// That its kernels compute the reference's bits is conformance_test's business; a smoke comparison is here.
#ifdef BERTH_WITH_OPENCL
#include "opencl/opencl.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <thread>

#include "berth/error.hpp"
#include "frame/marker_plan.hpp"
#include "frame/stages.hpp"
#include "opencl/devices.hpp"
#include "opencl/stream.hpp"

namespace berth::opencl {
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

TEST(OpenclDevices, AreChosenByIndexOrPartOfTheName) {
  const std::vector<std::string> names = {"pthread-haswell-AMD EPYC", "NVIDIA RTX 3090", "NVIDIA 1"};
  EXPECT_EQ(choose_device(names, ""), 0u);
  EXPECT_EQ(choose_device(names, "0"), 0u);
  EXPECT_EQ(choose_device(names, "2"), 2u);
  EXPECT_EQ(choose_device(names, "nvidia"), 1u);
  EXPECT_EQ(choose_device(names, "3090"), 1u) << "no such index, but a part of a name";
  const std::string error = error_of([&] { choose_device(names, "intel"); });
  EXPECT_THAT(error, AllOf(StartsWith("opencl: no device 'intel'"), HasSubstr("0: pthread-haswell-AMD EPYC"),
                           HasSubstr("2: NVIDIA 1")));
  EXPECT_THAT(error_of([&] { choose_device(names, "7"); }), HasSubstr("no device '7'"));
  EXPECT_THAT(error_of([&] { choose_device(names, "123456789012345678901"); }), HasSubstr("no device"));
}

TEST(OpenclDevices, MustBeAbleToRunTheKernels) {
  Abilities good;
  good.group_size = 128;
  good.group_width = 128;
  good.local_bytes = 16384;
  good.version = 102;
  EXPECT_EQ(shortcoming(good), "");
  const auto without = [&](const auto& change) {
    Abilities poor = good;
    change(poor);
    return shortcoming(poor);
  };
  EXPECT_THAT(without([](Abilities& a) { a.group_size = 64; }), HasSubstr("at most 64 work-items, not 128"));
  EXPECT_THAT(without([](Abilities& a) { a.group_width = 1; }), HasSubstr("at most 1 work-items, not 128"));
  EXPECT_THAT(without([](Abilities& a) { a.local_bytes = 8192; }), HasSubstr("8192 bytes, not 16384"));
  EXPECT_THAT(without([](Abilities& a) { a.version = 101; }), HasSubstr("older than OpenCL 1.2"));
  EXPECT_THAT(without([](Abilities& a) { a.compiler = false; }), HasSubstr("no compiler"));
  EXPECT_THAT(without([](Abilities& a) { a.available = false; }), HasSubstr("not available"));
  EXPECT_THAT(without([](Abilities& a) { a.little_endian = false; }), HasSubstr("big-endian"));
}

// What a process sees whose environment was different from its start: the loader reads it once.
TEST(OpenclChild, DISABLED_SaysWhatIsThere) {
  std::string absent;
  const std::vector<DeviceInfo> found = devices(absent);
  std::printf("child: %zu devices\nchild: %s\nchild: %s\n", found.size(), absent.c_str(),
              error_of([] { open({}); }).c_str());
}

std::string child_with(const std::string& variable) {
  char self[4096] = {};
  if (readlink("/proc/self/exe", self, sizeof self - 1) < 0) return "no /proc";
  const std::string command = "env " + variable + " '" + self +
                              "' --gtest_also_run_disabled_tests --gtest_filter=OpenclChild.DISABLED_SaysWhatIsThere";
  std::FILE* output = popen(command.c_str(), "r");
  std::string said;
  char line[4096];
  while (std::fgets(line, sizeof line, output) != nullptr) {
    if (std::string(line).compare(0, 7, "child: ") == 0) said += std::string(line).substr(7);
  }
  EXPECT_EQ(pclose(output), 0) << command;
  return said;
}

/// The reason that devices() gives and the one open() throws are the same, and end in a remedy.
void expect_absent(const std::string& said, const std::string& reason) {
  EXPECT_THAT(said, StartsWith("0 devices\nopencl: "));
  EXPECT_THAT(said, AllOf(HasSubstr(reason), HasSubstr("; ")));
  const std::size_t first = said.find('\n') + 1;
  const std::size_t second = said.find('\n', first) + 1;
  EXPECT_EQ(said.substr(first, second - first), said.substr(second));
}

TEST(OpenclAbsence, OfTheLoaderIsExplained) {
  const std::string said = child_with("BERTH_OPENCL_LIBRARY=/nowhere/libOpenCL.so.1");
  expect_absent(said, "BERTH_OPENCL_LIBRARY cannot be opened (/nowhere/libOpenCL.so.1");
}

TEST(OpenclAbsence, OfItsFunctionsIsExplained) {
  expect_absent(child_with("BERTH_OPENCL_LIBRARY=libc.so.6"), "libc.so.6 lacks clGetPlatformIDs of OpenCL 1.2");
}

TEST(OpenclAbsence, OfDriversIsExplained) {
  const std::string folder = "/tmp/berth-no-icd-" + std::to_string(getpid());
  std::filesystem::create_directory(folder);
  const std::string said = child_with("OCL_ICD_VENDORS=" + folder);
  std::filesystem::remove(folder);
  expect_absent(said, "no driver in OCL_ICD_VENDORS=" + folder);
  EXPECT_THAT(said, HasSubstr("apt install pocl-opencl-icd"));
}

class OpenclBackend : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string absent;
    if (devices(absent).empty()) GTEST_SKIP() << absent;
  }
};

TEST_F(OpenclBackend, OpensTheDeviceThatIsListed) {
  std::string absent = "stale";
  const std::vector<DeviceInfo> found = devices(absent);
  EXPECT_EQ(absent, "");
  BackendOptions options;
  options.device = std::to_string(found.size() - 1);
  const std::unique_ptr<Backend> backend = open(options);
  EXPECT_STREQ(backend->name(), "opencl");
  EXPECT_EQ(backend->device().name, found.back().name);
  EXPECT_EQ(backend->device().driver, found.back().driver);
  EXPECT_NE(found.back().driver, "");
  options.device = "no such device";
  EXPECT_THAT(error_of([&] { open(options); }), AllOf(HasSubstr("'no such device'"), HasSubstr(found[0].name)));
}

TEST_F(OpenclBackend, NeedsGroupsOf128) {
  const bool pocl = open({})->device().driver.find("Portable Computing Language") == 0;
  if (!pocl) GTEST_SKIP() << "only PoCL can be told to be smaller";
  expect_absent(child_with("POCL_MAX_WORK_GROUP_SIZE=64"), "at most 64 work-items, not 128");
}

TEST_F(OpenclBackend, MakesBuffersOfZeros) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Stream> stream = backend->make_stream();
  for (const std::size_t bytes : {1u, 4u, 1000u, 100000u}) {
    const std::unique_ptr<Buffer> buffer = backend->make_buffer(bytes);
    EXPECT_EQ(buffer->bytes(), bytes);
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
              StartsWith("opencl: a buffer of 1152921504606846976 bytes on "));
}

TEST_F(OpenclBackend, CopiesTheFirstBytesInOrder) {
  const std::unique_ptr<Backend> backend = open({});
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

TEST_F(OpenclBackend, RefusesStepsItCannotRun) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Backend> other = open({});
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

TEST_F(OpenclBackend, ReplaysAPlanAsOftenAsAsked) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Stream> stream = backend->make_stream();
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(4 * 4);
  // Not launched: no items. Then 1 1 1 | 0 → 0 1 2 | 3 → 0 0 1 | 3 → 0 0 0 | 1.
  const std::unique_ptr<Plan> plan = backend->record(
      {make_step(scan_params{0, 3}, {buffer.get()}, 0), make_step(scan_params{0, 3}, {buffer.get()}, 1)});
  const std::vector<u32> ones = {1, 1, 1, 0};
  std::vector<u32> result(4);
  stream->upload(*buffer, ones.data(), 16);
  for (int i = 0; i < 3; ++i) stream->replay(*plan);
  stream->download(*buffer, result.data(), 16);
  ASSERT_TRUE(stream->finish());
  EXPECT_EQ(result, (std::vector<u32>{0, 0, 0, 1}));
}

/// Squares and noise of few values; width and height that fit no word.
using Stages = std::vector<std::pair<std::string, std::vector<u32>>>;
Stages stages_of_a_frame(Backend& backend, unsigned seed) {
  constexpr int kWidth = 201;
  constexpr int kHeight = 99;
  std::mt19937 random(seed);
  GrayImage image(kWidth, kHeight);
  const View2D<u8> view = image.view();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool dark = (x / 30 + y / 30) % 2 == 0 && x % 30 > 4 && y % 30 > 4;
      view.at(x, y) = static_cast<u8>((dark ? 60 : 180) + (random() % 16 == 0 ? 60 : random() % 3));
    }
  }
  DetectorConfig config;
  config.families = {"tag36h11", "tagStandard41h12"};
  config.flat_field.assign(static_cast<std::size_t>(kWidth * kHeight), 1.0625F);
  MarkerPlan plan(backend, kWidth, kHeight, config);
  const MarkerGeometry& geometry = plan.geometry();
  const std::unique_ptr<Stream> stream = backend.make_stream();
  std::vector<u8> frame(geometry.frame_bytes());
  pad_frame(view, geometry, frame.data());
  Stages stages;
  stream->upload(plan.frame(), frame.data(), frame.size());
  stream->replay(plan.plan());
  EXPECT_TRUE(stream->finish());
  StageReader reader(plan, *stream);
  for (std::size_t i = 0; i < plan.stages().size(); ++i) stages.emplace_back(plan.stages()[i].name, reader.read(i));
  return stages;
}

TEST_F(OpenclBackend, ComputesTheReferencesFrame) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const Stages stages = stages_of_a_frame(*backend, 1);
  const Stages expected = stages_of_a_frame(*reference, 1);
  ASSERT_EQ(stages.size(), expected.size());
  std::ptrdiff_t squares = 0;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    EXPECT_EQ(stages[i], expected[i]);
    if (expected[i].first.find("quad_fit") == std::string::npos) continue;
    const std::vector<u32>& quads = expected[i].second;
    for (std::size_t at = 0; at < quads.size(); at += QUAD_WORDS) squares += (quads[at] & QUAD_VALID) != 0 ? 1 : 0;
  }
  EXPECT_GE(squares, 5) << "something to compare";
}

TEST_F(OpenclBackend, SharesADeviceBetweenThreads) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const std::unique_ptr<Backend> shared = open({});
  std::vector<Stages> results(4);
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < results.size(); ++i) {
    threads.emplace_back([&, i] {
      // Two threads with a backend of their own, two with streams of one.
      const std::unique_ptr<Backend> own = i % 2 == 0 ? open({}) : nullptr;
      for (int frame = 0; frame < 3; ++frame) results[i] = stages_of_a_frame(own != nullptr ? *own : *shared, i);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (unsigned i = 0; i < results.size(); ++i) EXPECT_EQ(results[i], stages_of_a_frame(*reference, i)) << i;
}

// A device that is lost: an api whose calls fail at will.
struct Failures {
  static cl_int enqueue, mark, wait;
};
cl_int Failures::enqueue, Failures::mark, Failures::wait;

Api failing_api() {
  Failures::enqueue = Failures::mark = Failures::wait = CL_SUCCESS;
  Api api;
  api.clEnqueueWriteBuffer = [](cl_command_queue, cl_mem, cl_bool, std::size_t, std::size_t, const void*, cl_uint,
                                const cl_event*, cl_event*) { return Failures::enqueue; };
  api.clEnqueueReadBuffer = [](cl_command_queue, cl_mem, cl_bool, std::size_t, std::size_t, void*, cl_uint,
                               const cl_event*, cl_event*) { return Failures::enqueue; };
  api.clEnqueueNDRangeKernel = [](cl_command_queue, cl_kernel, cl_uint, const std::size_t*, const std::size_t*,
                                  const std::size_t*, cl_uint, const cl_event*,
                                  cl_event*) { return Failures::enqueue; };
  api.clEnqueueMarkerWithWaitList = [](cl_command_queue, cl_uint, const cl_event*, cl_event*) {
    return Failures::mark;
  };
  api.clWaitForEvents = [](cl_uint, const cl_event*) { return Failures::wait; };
  api.clReleaseEvent = [](cl_event) -> cl_int { return CL_SUCCESS; };
  api.clFlush = [](cl_command_queue) -> cl_int { return CL_SUCCESS; };
  api.clFinish = [](cl_command_queue) -> cl_int { return CL_SUCCESS; };
  return api;
}

TEST(OpenclLoss, OfTheDeviceIsReportedByWaitAndFinish) {
  const Api api = failing_api();
  for (cl_int* failing : {&Failures::enqueue, &Failures::mark, &Failures::wait}) {
    ClBuffer buffer(4, nullptr, {});
    ClPlan plan;
    plan.launches.push_back({{}, 128});
    u32 word = 0;
    const std::unique_ptr<Stream> stream = make_stream(api, {});
    stream->upload(buffer, &word, 4);
    stream->replay(plan);
    EXPECT_TRUE(stream->record_event()->wait());
    EXPECT_TRUE(stream->finish());
    for (const cl_int status : {CL_DEVICE_NOT_AVAILABLE, CL_OUT_OF_RESOURCES, CL_INVALID_COMMAND_QUEUE,
                                CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST}) {
      *failing = status;
      stream->replay(plan);
      stream->download(buffer, &word, 4);
      EXPECT_FALSE(stream->record_event()->wait()) << status;
      EXPECT_FALSE(stream->finish()) << status;
    }
    *failing = CL_SUCCESS;
    EXPECT_FALSE(stream->finish()) << "a lost stream stays lost";
    EXPECT_FALSE(stream->record_event()->wait());
  }
}

}  // namespace
}  // namespace berth::opencl
#endif
