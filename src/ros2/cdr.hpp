#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <vector>

#include "berth/types.hpp"

namespace berth::ros2 {

/// One message as XCDR1 little-endian, the way ROS 2 sends and records it: four bytes that say so, then each value at a
/// multiple of its size from there on, with zeros between. Keeps its memory from message to message.
/// Source: OMG Data Distribution Service Interoperability Wire Protocol 2.3, 10.2; DDS-XTypes 1.3, 7.4.1.
class CdrWriter {
 public:
  /// Begins a new message.
  void begin() { bytes_.assign({0, 1, 0, 0}); }

  void boolean(bool value) { bytes_.push_back(value ? 1 : 0); }
  void uint8(u8 value) { bytes_.push_back(value); }
  void uint32(u32 value) { put(value, 4); }
  void int32(s32 value) { put(static_cast<u32>(value), 4); }
  void uint64(u64 value) { put(value, 8); }
  void int64(std::int64_t value) { put(static_cast<u64>(value), 8); }
  void float32(float value) {
    u32 bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    put(bits, 4);
  }
  void float64(double value) {
    u64 bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    put(bits, 8);
  }
  /// Its length with the closing zero, then its bytes; it holds no zero itself.
  void string(std::string_view text) {
    uint32(static_cast<u32>(text.size() + 1));
    octets(text.data(), text.size());
    bytes_.push_back(0);
  }
  /// A sequence's length; its elements follow.
  void length(std::size_t count) { uint32(static_cast<u32>(count)); }
  /// Bytes as they are.
  void octets(const void* data, std::size_t count) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + count);
    if (count > 0) std::memcpy(bytes_.data() + at, data, count);
  }
  template <class List>
  void float64s(const List& values) {
    for (const double value : values) float64(value);
  }

  /// The message so far, from its first four bytes on.
  const std::vector<u8>& bytes() const { return bytes_; }

 private:
  static constexpr std::size_t kHead = 4;

  void put(u64 value, std::size_t size) {
    assert(bytes_.size() >= kHead);
    const std::size_t at = kHead + (bytes_.size() - kHead + size - 1) / size * size;
    bytes_.resize(at + size);
    for (std::size_t i = 0; i < size; ++i) bytes_[at + i] = static_cast<u8>(value >> 8 * i);
  }

  std::vector<u8> bytes_;
};

}  // namespace berth::ros2
