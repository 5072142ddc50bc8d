#include "navigation/network_output.hpp"

#include <algorithm>
#include <cstdint>

namespace berth {
namespace {

constexpr s32 kMiddleQ16 = 127 * 65536 + 32768;
constexpr s32 kMaxExponent = 3 * 65536;

/// 2^(2^-i) in Q30, i = 1 … 16.
constexpr std::int64_t kRoots[16] = {1518500250, 1276901417, 1170923762, 1121280436, 1097253708, 1085434106,
                                     1079572136, 1076653033, 1075196443, 1074468888, 1074105294, 1073923544,
                                     1073832680, 1073787251, 1073764537, 1073753181};

/// 64 * 2^(e / 2^16), Q16.
s32 diameter_q16(s32 e) {
  const s32 held = std::clamp(e, -kMaxExponent, kMaxExponent);
  std::int64_t power = std::int64_t{1} << 30;
  for (int i = 1; i <= 16; ++i) {
    if ((held >> (16 - i) & 1) != 0) power = (power * kRoots[i - 1] + (std::int64_t{1} << 29)) >> 30;
  }
  return static_cast<s32>(power >> (8 - (held >> 16)));
}

}  // namespace

int score_of(const Network& network, int logit_q8) {
  return network.logistic[static_cast<std::size_t>(std::clamp(logit_q8, -2048, 2047) + 2048)];
}

NetworkOutput network_output(const Network& network, const s32* sums) {
  NetworkOutput output;
  const std::int64_t difference = static_cast<std::int64_t>(sums[1]) - sums[0];
  output.logit_q8 = std::clamp(network.score.apply(difference), -2048, 2047);
  output.score_q15 = score_of(network, output.logit_q8);
  if (network.heads.geometry == 0) return output;
  output.x_q16 = kMiddleQ16 + network.x.apply(sums[2]);
  output.y_q16 = kMiddleQ16 + network.y.apply(sums[3]);
  output.d_q16 = diameter_q16(network.d.apply(sums[4]));
  return output;
}

}  // namespace berth
