#include "support/network_case.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {
namespace {

OpCase normalized(const std::string& name, int pixels, int words, const std::vector<u32>& tensor,
                  const std::vector<u32>& table) {
  return make_case(name, local_response_norm_params{pixels, words}, {tensor, table, unwritten(pixels * words)},
                   pixels * words);
}

/// Falling as a network's tables do, from 2^16 - 1.
std::vector<u32> falling_table() {
  std::vector<u32> table;
  for (u32 i = 0; i < RESPONSE_TABLE; ++i) table.push_back(65535u - i * 631u);
  return table;
}

/// Every entry its own, steps of any size up and down.
std::vector<u32> random_table(u64 seed) {
  pictures::Random random(seed);
  std::vector<u32> table;
  for (int i = 0; i < RESPONSE_TABLE; ++i) table.push_back(static_cast<u32>(random.below(1 << 16)));
  return table;
}

/// A pixel of one word; the sums of its middle channels are those of all four.
u32 four(u32 a, u32 b, u32 c, u32 d) { return a | b << 8 | c << 16 | d << 24; }

}  // namespace

// Sums at the table's ends, 0 and 40320, and on either side of its knots, where their spacing changes too.
std::vector<OpCase> local_response_norm_cases() {
  std::vector<OpCase> cases;
  cases.push_back(normalized("zero", 3, 2, constant_s8(6, 0), random_table(1)));
  cases.push_back(normalized("greatest", 2, 4, constant_s8(8, 127), falling_table()));
  std::vector<u32> steep = falling_table();
  for (std::size_t i = 0; i < steep.size(); ++i) steep[i] = i % 2 == 0 ? 65535u : 0u;
  cases.push_back(normalized("greatest_steep", 2, 4, constant_s8(8, 127), steep));
  // Their second channels sum up to 0, 30, 32, 62, 64, 2046, 2048, 3070, 3072, 7166 and 7168 (halved squares are even).
  const std::vector<u32> knots = {four(1, 1, 1, 1),  four(7, 3, 2, 0),    four(8, 0, 0, 1),   four(8, 7, 3, 2),
                                  four(8, 8, 0, 0),  four(63, 10, 5, 0),  four(64, 0, 0, 0),  four(78, 7, 3, 0),
                                  four(78, 7, 3, 2), four(119, 10, 8, 3), four(119, 9, 9, 4), four(0, 0, 0, 64)};
  cases.push_back(normalized("knots", static_cast<int>(knots.size()), 1, knots, random_table(2)));
  cases.push_back(normalized("knots_steep", static_cast<int>(knots.size()), 1, knots, steep));
  // All sums of two squares of one word's first channels: every index up to 2^14 or so.
  std::vector<u32> pairs;
  for (u32 a = 0; a < 128; ++a) {
    for (u32 b = a % 3; b < 128; b += 3) pairs.push_back(four(a, b, 0, 0));
  }
  cases.push_back(normalized("pairs", static_cast<int>(pairs.size()), 1, pairs, random_table(3)));
  cases.push_back(normalized("dark", 100, 8, random_s8(800, 0, 40, 4), random_table(5)));
  cases.push_back(normalized("random", 333, 8, random_activations(333 * 8, 6), random_table(7)));
  cases.push_back(normalized("one_word", 300, 1, random_activations(300, 8), falling_table()));
  cases.push_back(normalized("two_words", 99, 2, random_activations(198, 9), falling_table()));
  // Whole vectors of channels with rises that fit 16 bits twice over, up and down; and with one too many.
  std::vector<u32> zigzag = falling_table();
  for (std::size_t i = 0; i < zigzag.size(); ++i) zigzag[i] = 30000u + static_cast<u32>(i % 2) * 16383u;
  cases.push_back(normalized("wide", 200, 16, random_activations(200 * 16, 12), falling_table()));
  cases.push_back(normalized("wide_dark", 200, 9, random_s8(200 * 9, 0, 60, 13), falling_table()));
  cases.push_back(normalized("wide_zigzag", 200, 24, random_s8(200 * 24, 0, 90, 14), zigzag));
  cases.push_back(normalized("wide_signed", 50, 8, random_s8(400, -40, 127, 15), zigzag));
  zigzag[3] += 1;
  cases.push_back(normalized("wide_steep", 100, 8, random_s8(800, 0, 60, 16), zigzag));
  cases.push_back(normalized("many_pixels", 2000, 3, random_s8(6000, 0, 127, 17), falling_table()));
  cases.push_back(normalized("bright", 50, 24, random_s8(1200, 100, 127, 10), random_table(11)));
  return cases;
}

}  // namespace berth::cases
