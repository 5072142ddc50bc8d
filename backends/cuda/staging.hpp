#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/context.hpp"

namespace berth::cuda {

/// Pinned memory that a stream's copies go through: from and to pageable memory the driver would copy while the caller
/// waits. A ring in the order of the copies; uploads are copied in when they are enqueued, downloads out when the host
/// has waited for them. It grows where it must, which needs the driver, and never shrinks. The context is current.
class Staging {
 public:
  explicit Staging(const Context& context) : context_(context) {}

  /// Makes room for that many bytes in copies that are not done.
  CUresult reserve(std::size_t bytes);
  /// Room for one more copy, which a download will leave for `to`; uploads have none. Null when there is no more
  /// memory.
  unsigned char* add(std::size_t bytes, void* to);
  /// How many copies there have been.
  std::uint64_t added() const { return added_; }
  /// The first `count` copies of all are done: downloads reach their destination, and the room is free again.
  void complete(std::uint64_t count);

 private:
  struct Copy {
    const unsigned char* memory;
    std::size_t bytes;
    void* to;
    std::size_t slab;
    std::uint64_t end;
  };

  const Context& context_;
  std::vector<Handle<void*>> slabs_;  // the last is the ring, earlier ones wait for their copies
  std::uint64_t capacity_ = 0;
  std::uint64_t head_ = 0;  // positions in the ring, not wrapped
  std::uint64_t tail_ = 0;
  std::vector<Copy> copies_;
  std::size_t first_ = 0;  // of copies_ that is not done
  std::uint64_t added_ = 0;
};

}  // namespace berth::cuda
