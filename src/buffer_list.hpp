#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/error.hpp"

namespace berth {

/// Fills a buffer before the first frame. Throws Error when the device is lost.
inline void upload_at_start(const Backend& backend, Stream& stream, Buffer& buffer, const void* data,
                            std::size_t bytes) {
  stream.upload(buffer, data, bytes);
  if (!stream.finish()) throw Error(std::string(backend.name()) + ": the device was lost at start");
}

/// The buffers of a plan, kept together for as long as it lives.
class BufferList {
 public:
  explicit BufferList(Backend& backend) : backend_(backend) {}

  /// A new one of `words` words.
  Buffer* make(std::size_t words) {
    buffers_.push_back(backend_.make_buffer(words * 4));
    return buffers_.back().get();
  }
  std::size_t device_bytes() const {
    std::size_t bytes = 0;
    for (const auto& buffer : buffers_) bytes += buffer->bytes();
    return bytes;
  }

 private:
  Backend& backend_;
  std::vector<std::unique_ptr<Buffer>> buffers_;
};

}  // namespace berth
