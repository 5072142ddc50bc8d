#pragma once

#include <cstddef>

#include "vulkan/gpu.hpp"

namespace berth::vulkan {

/// Host-visible memory that copies go through, used round and round: room is taken in order and given back in order.
class StagingRing {
 public:
  explicit StagingRing(Memory memory, std::size_t bytes) : memory_(std::move(memory)), bytes_(bytes) {}

  static constexpr std::size_t kNoRoom = ~std::size_t{0};
  /// Where `bytes` in a row are free, kNoRoom where not.
  std::size_t take(std::size_t bytes);
  /// What has been taken since the last call, for give_back.
  std::size_t mark();
  /// Gives back the oldest that was marked.
  void give_back(std::size_t marked) { used_ -= marked; }

  std::size_t bytes() const { return bytes_; }
  VkBuffer handle() const { return memory_.buffer.get(); }
  unsigned char* host() const { return static_cast<unsigned char*>(memory_.host); }

 private:
  Memory memory_;
  std::size_t bytes_;
  std::size_t next_ = 0;      // where the next one begins
  std::size_t used_ = 0;      // taken and not given back, gaps at the end included
  std::size_t unmarked_ = 0;  // of these, taken since the last mark
};

}  // namespace berth::vulkan
