#include "frame/digest.hpp"

namespace berth {

u64 digest_words(const u32* words, std::size_t count, u64 seed) {
  u64 hash = seed;
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ words[i]) * 0x100000001b3u;
  return hash;
}

}  // namespace berth
