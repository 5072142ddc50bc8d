#pragma once

#include <cassert>
#include <cstddef>
#include <memory>
#include <vector>

#include "berth/backend.hpp"

namespace berth {

/// Buffers that plans which run one after another on one stream have in common: what one leaves in them the next may
/// overwrite. Every plan asks for them in the same order, the one that needs most first.
class ScratchBuffers {
 public:
  explicit ScratchBuffers(Backend& backend) : backend_(backend) {}

  /// For the next plan.
  void begin() { next_ = 0; }
  Buffer* take(std::size_t words) {
    if (next_ == buffers_.size()) buffers_.push_back(backend_.make_buffer(words * 4));
    Buffer* const buffer = buffers_[next_++].get();
    assert(buffer->bytes() >= words * 4);
    return buffer;
  }
  std::size_t device_bytes() const {
    std::size_t bytes = 0;
    for (const auto& buffer : buffers_) bytes += buffer->bytes();
    return bytes;
  }

 private:
  Backend& backend_;
  std::vector<std::unique_ptr<Buffer>> buffers_;
  std::size_t next_ = 0;
};

}  // namespace berth
