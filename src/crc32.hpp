#pragma once

#include <array>
#include <cstddef>

#include "berth/types.hpp"

namespace berth {

namespace detail {
constexpr std::array<u32, 256> crc32_table() {
  std::array<u32, 256> table{};
  for (u32 byte = 0; byte < 256; ++byte) {
    u32 crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? 0xedb88320u ^ (crc >> 1) : crc >> 1;
    table[byte] = crc;
  }
  return table;
}
inline constexpr std::array<u32, 256> kCrc32Table = crc32_table();
}  // namespace detail

/// CRC-32 as zlib's and PNG's.
inline u32 crc32(const unsigned char* bytes, std::size_t count) {
  u32 crc = 0xffffffffu;
  for (std::size_t i = 0; i < count; ++i) crc = detail::kCrc32Table[(crc ^ bytes[i]) & 255u] ^ (crc >> 8);
  return ~crc;
}

}  // namespace berth
