// A network's scores and geometry on every backend, against those that training's own integers gave.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "berth/error.hpp"
#include "navigation/network_output.hpp"
#include "navigation/network_plan.hpp"

namespace berth {
namespace {

const char kFolder[] = BERTH_SOURCE_DIR "/training/tests/data/";
constexpr int kSide = 256;

struct Golden {
  u32 seed = 0;
  std::vector<s32> sums;  // of the heads
  NetworkOutput output;
};

std::vector<Golden> goldens() {
  std::ifstream file(std::string(kFolder) + "tiny_network.txt");
  std::vector<Golden> all;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    Golden golden;
    golden.sums.resize(5);
    fields >> golden.seed;
    for (s32& sum : golden.sums) fields >> sum;
    fields >> golden.output.score_q15 >> golden.output.x_q16 >> golden.output.y_q16 >> golden.output.d_q16;
    EXPECT_TRUE(fields) << line;
    all.push_back(golden);
  }
  return all;
}

/// The window of a seed, as tiny_network.txt defines it; outside 256 × 256 it goes on.
u8 window_pixel(u32 seed, u32 i, u32 j) {
  u32 x = seed * 65536 + j * 256 + i;
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  const auto tri = [](u32 t) {
    const s32 off = static_cast<s32>(t & 127u) - 64;
    return static_cast<u32>(off < 0 ? -off : off);
  };
  return static_cast<u8>(((tri((seed % 3 + 1) * i + 5 * seed) + tri(j + 11 * seed) + (x >> 26)) >> (seed & 3u)) +
                         16 * seed);
}

/// All windows below each other.
std::vector<u8> frame_of(const std::vector<Golden>& all) {
  std::vector<u8> frame;
  for (const Golden& golden : all) {
    for (u32 j = 0; j < kSide; ++j) {
      for (u32 i = 0; i < kSide; ++i) frame.push_back(window_pixel(golden.seed, i, j));
    }
  }
  return frame;
}

std::vector<std::string> backends_here() {
  std::vector<std::string> names;
  for (const BackendStatus& status : probe_backends()) {
    if (!status.devices.empty()) names.push_back(status.name);
  }
  return names;
}

class NetworkOn : public ::testing::TestWithParam<std::string> {
 protected:
  std::vector<s32> run(NetworkPlan& plan, Buffer& frame, const std::vector<u8>& pixels,
                       const std::vector<s32>& windows) {
    const std::unique_ptr<Stream> stream = backend_->make_stream();
    std::vector<s32> sums(plan.sums().bytes() / 4);
    stream->upload(frame, pixels.data(), pixels.size());
    stream->upload(plan.windows(), windows.data(), windows.size() * 4);
    stream->replay(plan.plan());
    stream->download(plan.sums(), sums.data(), sums.size() * 4);
    EXPECT_TRUE(stream->finish());
    return sums;
  }

  std::unique_ptr<Backend> backend_ = open_backend(GetParam());
  Network network_ = read_network(std::string(kFolder) + "tiny.berthnet");
  DeviceNetwork device_{*backend_, network_};
};

TEST_P(NetworkOn, GivesTheBitsOfTraining) {
  const std::vector<Golden> all = goldens();
  ASSERT_EQ(all.size(), 8u);
  const int count = static_cast<int>(all.size());
  const std::vector<u8> pixels = frame_of(all);
  const std::unique_ptr<Buffer> frame = backend_->make_buffer(pixels.size());
  NetworkPlan plan(device_, {frame.get(), kSide, kSide * count, kSide}, count, kSide, kSide);
  std::vector<s32> windows;
  for (int k = 0; k < count; ++k) windows.insert(windows.end(), {0, k * kSide * 256, 256, 0});
  const std::vector<s32> sums = run(plan, *frame, pixels, windows);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const s32* mine = sums.data() + k * static_cast<std::size_t>(plan.sums_each());
    EXPECT_EQ(std::vector<s32>(mine, mine + 5), all[k].sums) << "seed " << all[k].seed;
    const NetworkOutput output = network_output(network_, mine);
    EXPECT_EQ(output.score_q15, all[k].output.score_q15) << "seed " << all[k].seed;
    EXPECT_EQ(output.x_q16, all[k].output.x_q16) << "seed " << all[k].seed;
    EXPECT_EQ(output.y_q16, all[k].output.y_q16) << "seed " << all[k].seed;
    EXPECT_EQ(output.d_q16, all[k].output.d_q16) << "seed " << all[k].seed;
  }
}

// A larger window is a grid of positions, the first of which sees what a window of the network's side sees but for the
// padding at its right and lower end; here all backends must agree.
TEST_P(NetworkOn, SearchesALargerWindowAsTheReferenceDoes) {
  const std::vector<u8> pixels = frame_of(goldens());
  const auto sums_on = [&](Backend& backend) {
    const DeviceNetwork device(backend, network_);
    const std::unique_ptr<Buffer> frame = backend.make_buffer(pixels.size());
    NetworkPlan plan(device, {frame.get(), kSide, 8 * kSide, kSide}, 1, 384, 320);
    EXPECT_GT(plan.grid_width(), 1);
    EXPECT_GT(plan.grid_height(), 1);
    const std::unique_ptr<Stream> stream = backend.make_stream();
    const std::vector<s32> windows = {-64 * 256, 100, 700, 0};
    std::vector<s32> sums(plan.sums().bytes() / 4);
    stream->upload(*frame, pixels.data(), pixels.size());
    stream->upload(plan.windows(), windows.data(), windows.size() * 4);
    stream->replay(plan.plan());
    stream->download(plan.sums(), sums.data(), sums.size() * 4);
    EXPECT_TRUE(stream->finish());
    return sums;
  };
  EXPECT_EQ(sums_on(*backend_), sums_on(*open_backend("reference")));
}

INSTANTIATE_TEST_SUITE_P(Backends, NetworkOn, ::testing::ValuesIn(backends_here()),
                         [](const auto& tested) { return tested.param; });

TEST(NetworkPlan, RefusesAWindowSmallerThanTheNetworks) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const Network network = read_network(std::string(kFolder) + "tiny.berthnet");
  const DeviceNetwork device(*backend, network);
  const std::unique_ptr<Buffer> frame = backend->make_buffer(kSide * kSide);
  EXPECT_THAT(
      [&] {
        NetworkPlan(device, {frame.get(), kSide, kSide, kSide}, 1, 128, 256);
      },
      ::testing::ThrowsMessage<Error>(::testing::HasSubstr("a window of 128x256 px")));
}

}  // namespace
}  // namespace berth
