#pragma once

#include <cstddef>
#include <vector>

#include "support/op_case.hpp"
#include "support/pictures.hpp"

/// Values for the network's operations: weights, activations, channels.
namespace berth::cases {

/// Words of s8s from `low` to `high`.
inline std::vector<u32> random_s8(int words, int low, int high, u64 seed) {
  std::vector<u8> levels;
  for (int level = low; level <= high; ++level) levels.push_back(static_cast<u8>(level & 255));
  return random_bytes(static_cast<std::size_t>(words), levels, seed);
}
inline std::vector<u32> random_activations(int words, u64 seed) { return random_s8(words, 0, 127, seed); }
inline std::vector<u32> random_weights(int words, u64 seed) { return random_s8(words, -127, 127, seed); }

/// The same byte everywhere.
inline std::vector<u32> constant_s8(int words, int value) {
  return std::vector<u32>(static_cast<std::size_t>(words), static_cast<u32>(value & 255) * 0x01010101u);
}

/// Biases within ±bias and multipliers below 2^15, [channels, 2].
inline std::vector<u32> random_channels(int channels, int bias, u64 seed) {
  pictures::Random random(seed);
  std::vector<u32> made;
  for (int i = 0; i < channels; ++i) {
    made.push_back(static_cast<u32>(random.below(2 * bias + 1) - bias));
    made.push_back(static_cast<u32>(random.below(1 << 15)));
  }
  return made;
}

/// The same bias and multiplier for every channel.
inline std::vector<u32> constant_channels(int channels, s32 bias, s32 multiplier) {
  std::vector<u32> made;
  for (int i = 0; i < channels; ++i) {
    made.push_back(static_cast<u32>(bias));
    made.push_back(static_cast<u32>(multiplier));
  }
  return made;
}

/// What an output holds before it is written.
inline std::vector<u32> unwritten(int words) { return std::vector<u32>(static_cast<std::size_t>(words), 0x5aa55a11u); }

}  // namespace berth::cases
