#include "frame/digest.hpp"

#include <array>
#include <cstring>

namespace berth {

u64 digest_words(const u32* words, std::size_t count, u64 seed) {
  u64 hash = seed;
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ words[i]) * 0x100000001b3u;
  return hash;
}

u64 digest_number(double value, u64 seed) {
  std::array<u32, 2> words = {};
  std::memcpy(words.data(), &value, sizeof value);
  return digest_words(words.data(), words.size(), seed);
}

}  // namespace berth
