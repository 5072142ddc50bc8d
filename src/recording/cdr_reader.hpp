#pragma once

#include <cstddef>
#include <string>

#include "berth/types.hpp"

namespace berth {

/// Reads a ROS 2 message (XCDR1, either byte order) from bytes that may be anything: past their end everything is 0 or
/// empty, and ok() is false from then on.
class CdrReader {
 public:
  CdrReader(const u8* data, std::size_t size) : data_(data), size_(size) {
    ok_ = size >= kHead && data[0] == 0 && data[1] <= 1;
    big_endian_ = ok_ && data[1] == 0;
    at_ = ok_ ? kHead : size;
  }

  bool ok() const { return ok_; }
  u8 uint8() { return static_cast<u8>(number(1)); }
  u32 uint32() { return static_cast<u32>(number(4)); }
  std::string string() {
    const u32 size = uint32();
    const u8* const from = take(size);
    // With its closing zero.
    return from == nullptr || size == 0 ? std::string() : std::string(reinterpret_cast<const char*>(from), size - 1);
  }
  /// A sequence of bytes; null where it does not fit.
  const u8* bytes(std::size_t& size) {
    size = uint32();
    return take(size);
  }

 private:
  static constexpr std::size_t kHead = 4;

  const u8* take(std::size_t size) {
    if (!ok_ || size > size_ - at_) {
      ok_ = false;
      at_ = size_;
      return nullptr;
    }
    at_ += size;
    return data_ + at_ - size;
  }
  u64 number(std::size_t size) {
    take((size - (at_ - kHead) % size) % size);
    const u8* const from = take(size);
    u64 value = 0;
    for (std::size_t i = 0; from != nullptr && i < size; ++i) {
      value |= u64{from[i]} << 8 * (big_endian_ ? size - 1 - i : i);
    }
    return value;
  }

  const u8* data_;
  std::size_t size_;
  std::size_t at_ = 0;
  bool ok_ = false, big_endian_ = false;
};

}  // namespace berth
