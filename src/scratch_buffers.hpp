#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

#include "buffer_list.hpp"

namespace berth {

/// Buffers that plans which run one after another on one stream have in common: what one leaves in them the next may
/// overwrite. Every plan asks for them in the same order, the one that needs most first.
class ScratchBuffers {
 public:
  explicit ScratchBuffers(Backend& backend) : list_(backend) {}

  /// For the next plan.
  void begin() { next_ = 0; }
  Buffer* take(std::size_t words) {
    if (next_ == buffers_.size()) buffers_.push_back(list_.make(words));
    Buffer* const buffer = buffers_[next_++];
    assert(buffer->bytes() >= words * 4);
    return buffer;
  }
  std::size_t device_bytes() const { return list_.device_bytes(); }

 private:
  BufferList list_;
  std::vector<Buffer*> buffers_;  // of the list, in order
  std::size_t next_ = 0;
};

}  // namespace berth
