// A block's sums by vectors against their definition, on every instruction set that this machine has: the same
// integers.

#include "target/node_block.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "support/instruction_sets.hpp"
#include "target/pattern_cells.hpp"

namespace berth {
namespace {

TEST(EdgePieces, AreTheNormalDistributionAndNeverOverflow) {
  const EdgePieces pieces = EdgeProfile().pieces();
  for (int size = 0; size <= 32767; ++size) {
    const std::size_t k = static_cast<std::size_t>(size >> 12);
    const double f = ((size & 4095) << 3) / 32768.0, t = size / 8192.0;
    const double value = pieces[0][k] + f * (pieces[1][k] + f * (pieces[2][k] + f * pieces[3][k]));
    ASSERT_NEAR(value / 32764, std::erf(t / std::sqrt(2.0)), 3e-4) << t;
    // Rounding of three products and of the sums they enter.
    ASSERT_LT(value, 32767 - 2) << t;
    const double slope = pieces[1][k] + f * (2 * pieces[2][k] + f * 3 * pieces[3][k]);
    ASSERT_NEAR(2 * slope / 32764, std::exp(-t * t / 2) * std::sqrt(2 / std::acos(-1.0)), 3e-3) << t;
  }
}

class Blocks {
 public:
  explicit Blocks(unsigned seed) : random_(seed) {}

  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  bool coin(int one_in) { return integer(1, one_in) == 1; }

  // Coordinates that stay within four modules: slopes that take up to `reach` of them, the rest is for the constant.
  NodeCoordinate coordinate() {
    const int reach = integer(0, 110000);
    const int x = integer(-reach, reach) / 4, y = integer(-(reach - std::abs(4 * x)), reach - std::abs(4 * x)) / 4;
    const auto bend = [&] { return static_cast<std::int16_t>(integer(-100, 100)); };
    const int used = 4 * (std::abs(x) + std::abs(y)) + 16 * 300;
    return {integer(used, 4 * 65536 - 1 - used),
            {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), bend(), bend(), bend()}};
  }

  NodePlace place() {
    NodePlace m;
    m.row_step = integer(1, 2);
    m.gain_u = static_cast<std::int16_t>(integer(16384, 32767));
    m.gain_v = static_cast<std::int16_t>(integer(16384, 32767));
    m.doublings_u = integer(0, 5);
    m.doublings_v = integer(0, 5);
    m.correlation = static_cast<std::int16_t>(coin(4) ? 0 : integer(-29490, 29490));
    m.half_square = static_cast<std::int16_t>(m.correlation * m.correlation >> 16);
    m.tone = static_cast<std::int16_t>(coin(4) ? 0 : integer(-29491, 29491));
    m.most_residual = static_cast<std::int16_t>(coin(3) ? integer(0, 2032) : 2032);
    return m;
  }

  NodeBlock block(int x, int y) {
    NodeBlock m;
    m.x = x;
    m.y = y;
    m.u = coordinate();
    m.v = coordinate();
    m.whole = coin(2);
    m.u_first = m.whole ? 0 : integer(0, 131072);
    m.u_last = m.whole ? 4 * 65536 : integer(65536, 4 * 65536);
    m.v_first = m.whole ? 0 : integer(0, 131072);
    m.v_last = m.whole ? 4 * 65536 : integer(65536, 4 * 65536);
    m.all_known = true;
    const bool even = coin(4);
    for (std::size_t k = 0; k < 16; ++k) {
      const int tones = even ? 15 : integer(0, 15);
      const int a = tones & 1, b = tones >> 1 & 1, c = tones >> 2 & 1, d = tones >> 3;
      const bool known = !coin(30);
      m.all_known = m.all_known && known;
      const auto byte = [&](int sum) { return static_cast<std::int8_t>(known ? 8 * sum : 0); };
      m.nodes.even[k] = byte(a + b + c + d);
      m.nodes.by_u[k] = byte(b + d - a - c);
      m.nodes.by_v[k] = byte(c + d - a - b);
      m.nodes.both[k] = byte(a + d - b - c);
      m.nodes.known[k] = known ? -1 : 0;
    }
    const bool extreme = coin(4);
    m.dark = integer(extreme ? -511999 : 0, extreme ? 511999 : 60000);
    for (auto* const steps : {&m.dark_step, &m.contrast_step}) {
      for (auto& step : *steps) step = static_cast<std::int16_t>(extreme ? integer(-3993, 3993) : integer(-60, 60));
    }
    const int least = 4 * (std::abs(m.contrast_step[0]) + std::abs(m.contrast_step[1])) - 261119;
    m.contrast = integer(extreme ? least : 20000, extreme ? -least : 110000);
    return m;
  }

 private:
  std::mt19937 random_;
};

void expect_equal(const PlaceSums& expected, const PlaceSums& got, const char* target, int trial) {
  for (std::size_t row = 0; row < PlaceSums::kRows; ++row) {
    ASSERT_EQ(expected.rows[row], got.rows[row]) << target << ", place " << trial << ", row " << row;
  }
}

void compare(const char* target) {
  constexpr int kSize = 48;
  const EdgeProfile profile;
  Blocks blocks(7);
  GrayImage image(kSize, kSize);
  std::int64_t pixels = 0, edges = 0, pairs = 0, saturated = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    if (trial % 50 == 0) {
      const int low = blocks.integer(0, 200), high = blocks.coin(3) ? 255 : blocks.integer(low, 255);
      for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) image.view().row(y)[x] = static_cast<u8>(blocks.integer(low, high));
      }
    }
    PlaceSums expected, got;
    expected.clear();
    got.clear();
    // Up to four blocks a place at once, twice: sums grow.
    for (int turn = 0; turn < 2; ++turn) {
      NodeBlocks together;
      together.place = blocks.place();
      together.count = static_cast<std::size_t>(blocks.integer(0, NodeBlocks::kMost));
      for (std::size_t i = 0; i < together.count; ++i) {
        together.blocks[i] = blocks.block(blocks.integer(4, kSize - 4), blocks.integer(4, kSize - 4));
        reference::add_block(image.view(), profile.pieces(), together.place, together.blocks[i], expected);
      }
      add_blocks(image.view(), profile.pieces(), together, got);
    }
    ASSERT_NO_FATAL_FAILURE(expect_equal(expected, got, target, trial));
    const PixelCounts counts = expected.counts();
    pixels += counts.pixels;
    edges += counts.on_edges;
    pairs += counts.pairs;
    saturated += counts.saturated;
    EXPECT_EQ(counts.pixels, expected.rows[0]);
  }
  // The blocks show what they are meant to.
  EXPECT_GT(pixels, 50000);
  EXPECT_GT(edges, 20000);
  EXPECT_GT(pairs, 10000);
  EXPECT_GT(saturated, 500);
}

TEST(NodeBlock, IsItsDefinitionOnEveryInstructionSet) {
  test::for_each_instruction_set([](const char* name) { compare(name); });
}

}  // namespace
}  // namespace berth
