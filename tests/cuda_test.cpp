// The CUDA backend against a driver that keeps its books (tests/fake_cuda): the reference's bits with graphs and
// without, the stream's contract, and nothing asked of the driver once a detector runs. What becomes of calls that fail
// is cuda_failure_test's business.
#ifdef BERTH_WITH_CUDA
#include "cuda/cuda.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "cuda/devices.hpp"
#include "cuda/module.hpp"
#include "fake_cuda/fake_driver.hpp"
#include "support/pictures.hpp"
#include "verify/verify.hpp"

namespace berth::cuda {
namespace {

using ::testing::HasSubstr;

template <class Action>
std::string error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

/// What must hold after every test: nothing left behind, nothing done wrong.
class CudaDriver : public ::testing::TestWithParam<const char*> {
 protected:
  explicit CudaDriver(const char* variant = GetParam()) : driver(variant) {}
  void TearDown() override {
    EXPECT_STREQ(driver.fake_cuda_complaints(), "");
    EXPECT_EQ(driver.fake_cuda_live(), 0);
  }
  int calls(const char* function) { return driver.fake_cuda_calls(function); }
  FakeDriver driver;
};

INSTANTIATE_TEST_SUITE_P(Variants, CudaDriver, ::testing::Values("current", "cuda10", "no_graphs"),
                         [](const auto& tested) { return std::string(tested.param); });

/// A frame of each kind a camera may give; all of one size.
std::vector<GrayImage> frames(int count) {
  std::vector<GrayImage> made;
  for (int i = 0; i < count; ++i) {
    const u64 seed = static_cast<u64>(i);
    made.push_back(i % 5 == 4 ? pictures::mazes(320, 240, seed) : pictures::quads(320, 240, 3 + i, i % 4, seed));
  }
  return made;
}

DetectorConfig with_digests() {
  DetectorConfig config;
  config.families = {"tag36h11", "tagStandard41h12"};
  config.digests = true;
  return config;
}

std::vector<u64> digests_of(Detector& detector, const std::vector<GrayImage>& images) {
  std::vector<u64> digests;
  for (const GrayImage& image : images) {
    const FrameResult& result = detector.detect(image.view());
    EXPECT_NE(result.status, FrameStatus::device_lost);
    for (const StageDigest& digest : result.digests) digests.push_back(digest.digest);
  }
  return digests;
}

TEST_P(CudaDriver, AsksNothingOfTheDriverOnceADetectorRuns) {
  const std::vector<GrayImage> images = frames(20);
  {
    const std::unique_ptr<Backend> backend = open({});
    DetectorConfig config;
    config.flat_field.assign(std::size_t{320} * 240, 1.0625F);
    Detector detector(*backend, 320, 240, config);
    // What a frame calls, and nothing else: no memory, no module, no graph, no event is made.
    const bool graphs = std::string(GetParam()) != "no_graphs";
    const std::vector<std::string> on_the_way = {"cuCtxPushCurrent_v2",  "cuCtxPopCurrent_v2",
                                                 "cuMemcpyHtoDAsync_v2", "cuMemcpyDtoHAsync_v2",
                                                 "cuStreamSynchronize",  graphs ? "cuGraphLaunch" : "cuLaunchKernel"};
    const auto others = [&] {
      int all = driver.fake_cuda_all_calls();
      for (const std::string& name : on_the_way) all -= calls(name.c_str());
      return all;
    };
    const int before = others();
    const int uploads = calls("cuMemcpyHtoDAsync_v2");
    for (const GrayImage& image : images) detector.detect(image.view());
    EXPECT_EQ(others(), before);
    EXPECT_EQ(calls("cuMemcpyHtoDAsync_v2"), uploads + 20);
    EXPECT_EQ(calls("cuGraphLaunch") > 0, graphs);
    EXPECT_EQ(calls("cuLaunchKernel") > 0, !graphs);
  }
}

TEST_P(CudaDriver, SharesADeviceBetweenDetectors) {
  const std::vector<GrayImage> images = frames(5);
  std::vector<u64> expected;
  {
    const std::unique_ptr<Backend> reference = open_backend("reference");
    Detector detector(*reference, 320, 240, with_digests());
    expected = digests_of(detector, images);
  }
  ASSERT_FALSE(expected.empty());
  const std::unique_ptr<Backend> shared = open({});
  std::vector<std::vector<u64>> found(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < found.size(); ++i) {
    threads.emplace_back([&, i] {
      // Two threads with a backend of their own, two with detectors on one.
      const std::unique_ptr<Backend> own = i % 2 == 0 ? open({}) : nullptr;
      Detector detector(own != nullptr ? *own : *shared, 320, 240, with_digests());
      found[i] = digests_of(detector, images);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::vector<u64>& digests : found) EXPECT_EQ(digests, expected);
}

TEST_P(CudaDriver, WaitsOnlyInWaitAndFinish) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Stream> stream = backend->make_stream();
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(16);
  const std::unique_ptr<Plan> plan = backend->record({make_step(scan_params{0, 3}, {buffer.get()}, 1)});
  std::vector<u32> before(4, 99), after(4, 99);
  std::unique_ptr<Event> first;
  driver.fake_cuda_hold(true);
  {
    const std::vector<u32> ones = {1, 1, 1, 0};
    stream->upload(*buffer, ones.data(), 16);
    stream->download(*buffer, before.data(), 16);
    first = stream->record_event();
    stream->replay(*plan);
    stream->download(*buffer, after.data(), 16);
  }
  EXPECT_EQ(before[0], 99u) << "nothing has run";
  std::thread waiter([&] { EXPECT_TRUE(first->wait()); });
  driver.fake_cuda_hold(false);
  waiter.join();
  EXPECT_EQ(before, (std::vector<u32>{1, 1, 1, 0}));
  EXPECT_EQ(after[0], 99u) << "not waited for";
  EXPECT_TRUE(first->wait()) << "once more";
  EXPECT_TRUE(stream->finish());
  EXPECT_EQ(after, (std::vector<u32>{0, 1, 2, 3}));
}

// Copies of many sizes under way at once: the ring wraps, grows and is reused.
TEST_P(CudaDriver, KeepsCopiesApart) {
  constexpr std::size_t kBytes = 400000;
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(kBytes);
  const std::unique_ptr<Stream> stream = backend->make_stream();
  pictures::Random random(3);
  struct Frame {
    std::vector<u8> sent, received;
    std::unique_ptr<Event> done;
  };
  std::vector<Frame> under_way;
  int waited = 0;
  const auto wait_for_first = [&] {
    ASSERT_TRUE(under_way.front().done->wait());
    EXPECT_EQ(under_way.front().received, under_way.front().sent);
    under_way.erase(under_way.begin());
    ++waited;
  };
  for (int i = 0; i < 300; ++i) {
    Frame frame;
    frame.sent.resize(static_cast<std::size_t>(random.below(kBytes)));
    for (std::size_t k = 0; k < frame.sent.size(); k += 61) frame.sent[k] = static_cast<u8>(random.next());
    frame.received.resize(frame.sent.size());
    stream->upload(*buffer, frame.sent.data(), frame.sent.size());
    stream->download(*buffer, frame.received.data(), frame.received.size());
    frame.done = stream->record_event();
    under_way.push_back(std::move(frame));
    while (under_way.size() > static_cast<std::size_t>(1 + i / 100 * 2)) wait_for_first();
  }
  const int grown = calls("cuMemHostAlloc");
  EXPECT_LE(grown, 6);
  EXPECT_LE(calls("cuEventCreate"), 6) << "events are used again";
  while (!under_way.empty()) wait_for_first();
  EXPECT_EQ(waited, 300);
  EXPECT_TRUE(stream->finish());
}

TEST_P(CudaDriver, LetsAnEventOutliveItsStream) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(4);
  std::unique_ptr<Stream> stream = backend->make_stream();
  const u32 sent = 7;
  u32 received = 0;
  stream->upload(*buffer, &sent, 4);
  stream->download(*buffer, &received, 4);
  const std::unique_ptr<Event> event = stream->record_event();
  stream.reset();
  EXPECT_EQ(received, 7u) << "a stream finishes first";
  EXPECT_TRUE(event->wait());
}

TEST_P(CudaDriver, MakesBuffersOfZeros) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Stream> stream = backend->make_stream();
  for (const std::size_t bytes : {1u, 4u, 1000u, 100000u}) {
    const std::unique_ptr<Buffer> buffer = backend->make_buffer(bytes);
    EXPECT_EQ(buffer->bytes(), bytes);
    EXPECT_EQ(buffer->host(), nullptr);
    std::vector<u8> read(bytes, 0xee);
    stream->download(*buffer, read.data(), bytes);
    ASSERT_TRUE(stream->finish());
    EXPECT_EQ(read, std::vector<u8>(bytes, 0));
  }
  const std::unique_ptr<Buffer> empty = backend->make_buffer(0);
  stream->upload(*empty, nullptr, 0);
  stream->download(*empty, nullptr, 0);
  EXPECT_TRUE(stream->finish());
}

TEST_P(CudaDriver, ReplaysAPlanAsOftenAsAsked) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Stream> stream = backend->make_stream();
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(4 * 4);
  // Not launched: no items. Then 1 1 1 | 0 → 0 1 2 | 3 → 0 0 1 | 3 → 0 0 0 | 1.
  const Step none = make_step(scan_params{0, 3}, {buffer.get()}, 0);
  const Step scan = make_step(scan_params{0, 3}, {buffer.get()}, 1);
  const std::unique_ptr<Plan> empty = backend->record({none});
  const std::unique_ptr<Plan> once = backend->record({none, scan});
  const std::unique_ptr<Plan> twice = backend->record({scan, none, scan});
  const std::vector<u32> ones = {1, 1, 1, 0};
  std::vector<u32> result(4);
  stream->upload(*buffer, ones.data(), 16);
  stream->replay(*empty);
  stream->replay(*once);
  stream->replay(*twice);
  stream->download(*buffer, result.data(), 16);
  ASSERT_TRUE(stream->finish());
  EXPECT_EQ(result, (std::vector<u32>{0, 0, 0, 1}));
}

TEST_P(CudaDriver, TimesEachStep) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Stream> stream = backend->make_stream();
  const std::unique_ptr<Buffer> buffer = backend->make_buffer(16);
  const std::unique_ptr<Plan> plan =
      backend->record({make_step(scan_params{0, 3}, {buffer.get()}, 1), make_step(scan_params{0, 3}, {buffer.get()}, 0),
                       make_step(scan_params{0, 3}, {buffer.get()}, 1)});
  constexpr std::int64_t kMs = 1000000;  // this driver's clock: a work-group takes one
  EXPECT_EQ(stream->time_steps(*plan), (std::vector<std::int64_t>{kMs, 0, kMs}));
  EXPECT_TRUE(stream->finish());
}

TEST_P(CudaDriver, RefusesStepsItCannotRun) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Backend> other = open({});
  const std::unique_ptr<Backend> host = open_backend("reference");
  const std::unique_ptr<Buffer> mine = backend->make_buffer(64);
  const std::unique_ptr<Buffer> its = other->make_buffer(64);
  const std::unique_ptr<Buffer> hosts = host->make_buffer(64);
  const scan_params params{0, 3};
  for (Buffer* foreign : {its.get(), hosts.get()}) {
    EXPECT_THAT(error_of([&] { backend->record({make_step(params, {foreign}, 128)}); }),
                HasSubstr("an argument of scan is not a buffer of this backend"));
  }
  Step short_of_params = make_step(params, {mine.get()}, 128);
  short_of_params.params.pop_back();
  EXPECT_THAT(error_of([&] { backend->record({short_of_params}); }), HasSubstr("scan is missing"));
  Step short_of_buffers = make_step(params, {mine.get()}, 128);
  short_of_buffers.buffers.clear();
  EXPECT_THAT(error_of([&] { backend->record({short_of_buffers}); }), HasSubstr("scan is missing"));
}

class CudaImages : public CudaDriver {
 protected:
  CudaImages() : CudaDriver("current") {}
};

// The other variants compare whole frames' digests: it is the same kernels.
TEST_F(CudaImages, ComputeTheReferencesBits) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const VerifyReport report = verify_backend(*backend, *reference);
  EXPECT_EQ(report.first_difference, "");
  EXPECT_TRUE(report.ok);
  EXPECT_GT(report.cases, 500);
  EXPECT_GT(report.frames, 10);
}

/// As fake_cuda_loaded calls it.
std::string kind_of(const Image& image) { return image.name == std::string("fatbin") ? "fatbin" : "ptx"; }

TEST_F(CudaImages, AreChosenForTheDevice) {
  ASSERT_FALSE(device_images().empty());
  for (const int capability : {53, 62, 72, 75, 87, 90, 121}) {
    const auto fits = [&](const Image& image) { return image.least_capability <= capability; };
    const auto first = std::find_if(device_images().begin(), device_images().end(), fits);
    const auto last = std::find_if(device_images().rbegin(), device_images().rend(), fits);
    driver.fake_cuda_set_devices(capability_text(capability).c_str());
    const int before = calls("cuModuleLoadDataEx");
    if (first == device_images().end()) {
      EXPECT_THAT(error_of([] { open({}); }), HasSubstr("(this build has none for it)"));
      EXPECT_EQ(calls("cuModuleLoadDataEx"), before);
      continue;
    }
    open({});
    EXPECT_EQ(driver.fake_cuda_loaded(), kind_of(*first)) << capability;
    EXPECT_EQ(calls("cuModuleLoadDataEx"), before + 1) << capability;
    BackendOptions baseline;
    baseline.baseline_only = true;
    open(baseline);
    EXPECT_EQ(driver.fake_cuda_loaded(), kind_of(*last)) << capability;
  }
}

TEST_F(CudaImages, GiveWayToTheNextUntilThereIsNone) {
  driver.fake_cuda_refuse("fatbin", 222, "Unsupported .version 9.0; current version is '7.8'\n");
  const bool has_ptx = kind_of(device_images().back()) == "ptx";
  const std::string error = error_of([] { open({}); });
  if (has_ptx) {
    EXPECT_EQ(error, "no error");
    EXPECT_STREQ(driver.fake_cuda_loaded(), "ptx");
  }
  driver.fake_cuda_refuse("ptx", 218, "ptxas fatal : no luck\n");
  std::string logs;
  for (const Image& image : device_images()) {
    logs += std::string(logs.empty() ? "" : "; ") + image.name +
            (kind_of(image) == "ptx" ? ": 218, ptxas fatal : no luck"
                                     : ": 222, Unsupported .version 9.0; current version is '7.8'");
  }
  EXPECT_EQ(
      error_of([] { open({}); }),
      "cuda: the driver, for CUDA 12.4, takes no image of the kernels for Fake GPU 0 (9.0), compute capability 9.0 (" +
          logs + "); update the driver");
}

TEST_F(CudaImages, OfTheBaselineAreLaunchedOneByOne) {
  BackendOptions baseline;
  baseline.baseline_only = true;
  const std::unique_ptr<Backend> backend = open(baseline);
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const std::vector<GrayImage> images = frames(3);
  Detector found(*backend, 320, 240, with_digests());
  Detector expected(*reference, 320, 240, with_digests());
  EXPECT_EQ(digests_of(found, images), digests_of(expected, images));
  EXPECT_EQ(calls("cuGraphCreate"), 0);
  EXPECT_GT(calls("cuLaunchKernel"), 0);
}

}  // namespace
}  // namespace berth::cuda
#endif
