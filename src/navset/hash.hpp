#pragma once

#include <cstddef>

#include "berth/types.hpp"

namespace berth::navset {

constexpr u64 kHashStart = 0xcbf29ce484222325u;

/// 64-bit FNV-1a over bytes, to be continued from an earlier hash.
inline u64 hash_bytes(const void* bytes, std::size_t count, u64 hash = kHashStart) {
  const auto* at = static_cast<const unsigned char*>(bytes);
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ at[i]) * 0x100000001b3u;
  return hash;
}

}  // namespace berth::navset
