// What the CUDA backend makes of a driver that is absent, too old, out of memory, or fails: at start an Error that says
// why and leaves nothing behind, in flight a lost stream, and never a crash. Every function it calls fails once.
#ifdef BERTH_WITH_CUDA
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "cuda/cuda.hpp"
#include "cuda/devices.hpp"
#include "fake_cuda/fake_driver.hpp"
#include "support/pictures.hpp"

namespace berth::cuda {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr int kUnknownError = 999;

template <class Action>
std::string error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// The reason that devices() gives and the one open() throws are the same.
std::string absence() {
  std::string reason = "stale";
  EXPECT_TRUE(devices(reason).empty());
  EXPECT_EQ(error_of([] { open({}); }), reason);
  return reason;
}

TEST(CudaDevices, AreChosenByIndexOrPartOfTheName) {
  const std::vector<Device> devices = {
      {0, "NVIDIA Tegra X1", 53}, {1, "NVIDIA GeForce RTX 3090", 86}, {2, "H200 1", 90}};
  EXPECT_EQ(choose_device(devices, ""), 0u);
  EXPECT_EQ(choose_device(devices, "2"), 2u);
  EXPECT_EQ(choose_device(devices, "geforce"), 1u);
  EXPECT_EQ(choose_device(devices, "3090"), 1u) << "no such index, but a part of a name";
  EXPECT_THAT(error_of([&] { choose_device(devices, "radeon"); }),
              AllOf(StartsWith("cuda: no device 'radeon'"), HasSubstr("0: NVIDIA Tegra X1"), HasSubstr("2: H200 1")));
  EXPECT_THAT(error_of([&] { choose_device(devices, "7"); }), HasSubstr("no device '7'"));
  EXPECT_THAT(error_of([&] { choose_device(devices, "123456789012345678901"); }), HasSubstr("no device"));
}

TEST(CudaAbsence, OfTheLibraryIsExplained) {
  setenv("BERTH_CUDA_LIBRARY", "/nowhere/libcuda.so.1", 1);
  EXPECT_THAT(absence(), StartsWith("cuda: BERTH_CUDA_LIBRARY cannot be opened (/nowhere/libcuda.so.1"));
  setenv("BERTH_CUDA_LIBRARY", "libc.so.6", 1);
  EXPECT_THAT(absence(), StartsWith("cuda: libc.so.6 lacks cuInit; Berth needs a driver for CUDA 10.2 or later"));
  unsetenv("BERTH_CUDA_LIBRARY");
  if (void* library = dlopen("libcuda.so.1", RTLD_LAZY)) {
    dlclose(library);
    GTEST_SKIP() << "this machine has a driver";
  }
  EXPECT_THAT(absence(), AllOf(StartsWith("cuda: no CUDA driver (libcuda.so.1: "), HasSubstr("nvidia-driver")));
}

class CudaFailure : public ::testing::TestWithParam<const char*> {
 protected:
  explicit CudaFailure(const char* variant = GetParam()) : driver(variant) {}
  void TearDown() override { expect_clean("the test"); }
  void expect_clean(const std::string& where) {
    EXPECT_STREQ(driver.fake_cuda_complaints(), "") << where;
    EXPECT_EQ(driver.fake_cuda_live(), 0) << where;
  }
  FakeDriver driver;
};

INSTANTIATE_TEST_SUITE_P(Variants, CudaFailure, ::testing::Values("current", "cuda10", "no_graphs"),
                         [](const auto& tested) { return std::string(tested.param); });

TEST_P(CudaFailure, OfWhatIsThereIsExplained) {
  driver.fake_cuda_set_devices("");
  EXPECT_THAT(absence(), StartsWith("cuda: the driver finds no device; see nvidia-smi"));
  driver.fake_cuda_set_devices("5.2,3.5");
  EXPECT_THAT(absence(),
              AllOf(StartsWith("cuda: no device can run the kernels (Fake GPU 0 (5.2) has compute capability "
                               "5.2, not 5.3; Fake GPU 1 (3.5)"),
                    HasSubstr("use another backend")));
  driver.fake_cuda_set_devices("5.2,5.3,9.0");
  std::string absent;
  const std::vector<DeviceInfo> found = devices(absent);
  ASSERT_EQ(found.size(), 2u) << absent;
  EXPECT_EQ(found[0].name, "Fake GPU 1 (5.3)");
  EXPECT_EQ(found[0].driver, "CUDA 12.4, compute capability 5.3");
  BackendOptions second;
  second.device = "1";
  EXPECT_EQ(open(second)->device().name, "Fake GPU 2 (9.0)");
  second.device = "gtx";
  EXPECT_THAT(error_of([&] { open(second); }), AllOf(HasSubstr("no device 'gtx'"), HasSubstr("1: Fake GPU 2 (9.0)")));
  driver.fake_cuda_set_version(9020);
  EXPECT_THAT(absence(), StartsWith("cuda: the driver is for CUDA 9.2; Berth needs one for CUDA 10.2 or later"));
  driver.fake_cuda_set_version(10020);
  second.device = "1";
  EXPECT_NE(open(second), nullptr);
  driver.fake_cuda_fail("cuInit", 1, 803, false);
  EXPECT_THAT(error_of([] { open({}); }), HasSubstr("starting the driver failed (803); does nvidia-smi work?"));
}

TEST_P(CudaFailure, OfMemoryNamesTheBytes) {
  driver.fake_cuda_set_memory(100000);
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Buffer> fits = backend->make_buffer(100000);
  EXPECT_THAT(error_of([&] { backend->make_buffer(1); }),
              StartsWith("cuda: a buffer of 1 bytes on Fake GPU 0 (9.0) failed (2 CUDA_ERROR_OUT_OF_MEMORY)"));
  EXPECT_THAT(error_of([&] { Detector(*backend, 640, 480, {}); }), HasSubstr("307200 bytes"));
  driver.fake_cuda_fail("cuMemHostAlloc", 1, 2, false);
  EXPECT_THAT(error_of([&] { backend->make_stream(); }),
              StartsWith("cuda: pinned memory of 100000 bytes for a stream's copies failed (2 CUDA_ERROR_OUT"));
  EXPECT_NE(backend->make_stream(), nullptr) << "once there is some";
}

const std::vector<std::string>& all_functions() {
  static const std::vector<std::string> names = {
#define X(function, parameters) #function,
      BERTH_CUDA_FUNCTIONS(X) BERTH_CUDA_GRAPH_FUNCTIONS(X) BERTH_CUDA_RENAMED_FUNCTIONS(X)
#undef X
  };
  return names;
}

/// Gives something back: its failing is nobody's to report.
bool gives_back(const std::string& function) {
  for (const char* word : {"Destroy", "Free", "Unload", "Release", "Pop"}) {
    if (function.find(word) != std::string::npos) return true;
  }
  return false;
}

void start() {
  const std::unique_ptr<Backend> backend = open({});
  const Detector detector(*backend, 64, 48, {});
}

TEST_P(CudaFailure, OfAnyCallAtStartIsAnErrorAndLeavesNothing) {
  start();
  std::vector<std::pair<std::string, int>> called;
  for (const std::string& function : all_functions()) {
    if (driver.fake_cuda_calls(function.c_str()) > 0)
      called.emplace_back(function, driver.fake_cuda_calls(function.c_str()));
  }
  EXPECT_GE(called.size(), 20u);
  int failed = 0;
  for (const auto& [function, count] : called) {
    for (int nth = 1; nth <= count; nth += 1 + count / 7) {
      for (const bool lasting : {false, true}) {
        // A context is either there or lost for good.
        if (function == "cuCtxPushCurrent_v2" && !lasting) continue;
        driver.fake_cuda_reset();
        driver.fake_cuda_fail(function.c_str(), nth, kUnknownError, lasting);
        const std::string error = error_of(start);
        const std::string where = function + ", call " + std::to_string(nth) + (lasting ? " and all later ones" : "");
        expect_clean(where);
        if (error == "no error") continue;
        ++failed;
        // In the detector's first, empty frame nobody hears the driver's number.
        EXPECT_THAT(error, AllOf(StartsWith("cuda: "), AnyOf(HasSubstr("999"), HasSubstr("first, empty frame"))))
            << where;
      }
    }
    // The first call of all must succeed for a start to succeed, but for those of a frame.
    const bool of_a_frame =
        function.find("Memcpy") != std::string::npos || function.find("Launch") != std::string::npos;
    if (gives_back(function) || of_a_frame || function == "cuModuleLoadDataEx") continue;
    driver.fake_cuda_reset();
    driver.fake_cuda_fail(function.c_str(), 1, kUnknownError, true);
    EXPECT_NE(error_of(start), "no error") << function;
  }
  EXPECT_GE(failed, 40);
}

/// A frame's calls on a stream of its own, some of which fail; then whether the stream knows, and stays lost.
TEST_P(CudaFailure, OfAnyCallInFlightLosesTheStream) {
  for (const std::string function :
       {"cuCtxPushCurrent_v2", "cuMemcpyHtoDAsync_v2", "cuMemcpyDtoHAsync_v2", "cuGraphLaunch", "cuLaunchKernel",
        "cuMemHostAlloc", "cuEventCreate", "cuEventRecord", "cuEventSynchronize", "cuStreamSynchronize"}) {
    const bool graphs = std::string(GetParam()) != "no_graphs";
    if (function == (graphs ? "cuLaunchKernel" : "cuGraphLaunch")) continue;
    for (const bool lasting : {false, true}) {
      if (function == "cuCtxPushCurrent_v2" && !lasting) continue;
      driver.fake_cuda_reset();
      {
        const std::unique_ptr<Backend> backend = open({});
        const std::unique_ptr<Stream> stream = backend->make_stream();
        const std::unique_ptr<Stream> other = backend->make_stream();
        const std::unique_ptr<Buffer> buffer = backend->make_buffer(16);
        const std::unique_ptr<Plan> plan = backend->record({make_step(scan_params{0, 3}, {buffer.get()}, 1)});
        std::vector<u32> data = {1, 1, 1, 0};
        driver.fake_cuda_fail(function.c_str(), 1, kUnknownError, lasting);
        stream->upload(*buffer, data.data(), 16);
        stream->replay(*plan);
        stream->download(*buffer, data.data(), 16);
        const std::unique_ptr<Event> event = stream->record_event();
        const bool waited = event->wait();
        EXPECT_FALSE(waited && stream->finish()) << function;
        for (int i = 0; i < 2; ++i) {
          stream->upload(*buffer, data.data(), 16);
          stream->replay(*plan);
          stream->download(*buffer, data.data(), 16);
          EXPECT_FALSE(stream->record_event()->wait()) << function;
          EXPECT_FALSE(event->wait()) << function;
          EXPECT_FALSE(stream->finish()) << function;
          EXPECT_TRUE(stream->time_steps(*plan).empty()) << function;
        }
        const std::vector<u32> untouched = {1, 1, 1, 0};
        EXPECT_TRUE(waited || data == untouched) << function << ": nothing half done is shown";
        EXPECT_EQ(other->finish(), !lasting) << "another stream finds out for itself";
      }
      expect_clean(function);
    }
  }
}

TEST_P(CudaFailure, OfTimingLosesTheStream) {
  const char* elapsed = std::string(GetParam()) == "current" ? "cuEventElapsedTime_v2" : "cuEventElapsedTime";
  for (const char* function : {"cuEventCreate", "cuEventRecord", "cuLaunchKernel", "cuEventSynchronize", elapsed}) {
    const std::unique_ptr<Backend> backend = open({});
    const std::unique_ptr<Buffer> buffer = backend->make_buffer(16);
    const std::unique_ptr<Stream> stream = backend->make_stream();
    const std::unique_ptr<Plan> plan = backend->record({make_step(scan_params{0, 3}, {buffer.get()}, 1)});
    EXPECT_EQ(stream->time_steps(*plan).size(), 1u);
    driver.fake_cuda_fail(function, 1, kUnknownError, false);
    EXPECT_TRUE(stream->time_steps(*plan).empty()) << function;
    EXPECT_FALSE(stream->finish()) << function;
  }
}

TEST_P(CudaFailure, OfAKernelEndsItsFrameAsLost) {
  const GrayImage image = pictures::quads(320, 240, 5, 1, 1);
  const std::unique_ptr<Backend> backend = open({});
  Detector detector(*backend, 320, 240, {});
  Detector other(*backend, 320, 240, {});
  EXPECT_NE(detector.detect(image.view()).status, FrameStatus::device_lost);
  driver.fake_cuda_lose_at_kernel(10);
  detector.submit(image.view(), {});
  const FrameResult& result = detector.collect();
  EXPECT_EQ(result.status, FrameStatus::device_lost);
  EXPECT_TRUE(result.detections.empty());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(detector.detect(image.view()).status, FrameStatus::device_lost);
  EXPECT_EQ(other.detect(image.view()).status, FrameStatus::device_lost) << "it is the same device";
  EXPECT_THAT(error_of([&] { backend->make_buffer(4); }), HasSubstr("719 CUDA_ERROR_LAUNCH_FAILED"));
}

}  // namespace
}  // namespace berth::cuda
#endif
