#include "vulkan/staging.hpp"

namespace berth::vulkan {

std::size_t StagingRing::take(std::size_t bytes) {
  const std::size_t size = (bytes + 15) / 16 * 16;
  if (used_ == 0) next_ = 0;
  const bool wraps = next_ + size > bytes_;
  const std::size_t gap = wraps ? bytes_ - next_ : 0;
  if (used_ + gap + size > bytes_) return kNoRoom;
  const std::size_t at = wraps ? 0 : next_;
  next_ = at + size;
  used_ += gap + size;
  unmarked_ += gap + size;
  return at;
}

std::size_t StagingRing::mark() {
  const std::size_t marked = unmarked_;
  unmarked_ = 0;
  return marked;
}

}  // namespace berth::vulkan
