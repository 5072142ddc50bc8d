#pragma once

#include <vector>

#include "berth/types.hpp"

namespace berth {

inline u32 read_le32(const unsigned char* bytes) {
  u32 value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | bytes[i];
  return value;
}

inline void write_le32(unsigned char* bytes, u32 value) {
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<unsigned char>(value >> 8 * i);
}

inline void append_le32(std::vector<unsigned char>& bytes, u32 value) {
  bytes.resize(bytes.size() + 4);
  write_le32(bytes.data() + bytes.size() - 4, value);
}

}  // namespace berth
