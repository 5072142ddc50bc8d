#include "cuda/staging.hpp"

#include <algorithm>
#include <cstring>

namespace berth::cuda {
namespace {

constexpr std::uint64_t kAlignment = 256;
constexpr std::uint64_t kLeastSlab = std::uint64_t{1} << 18;
constexpr std::size_t kCopiesAhead = 64;

std::uint64_t aligned(std::uint64_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

}  // namespace

CUresult Staging::reserve(std::size_t bytes) {
  if (copies_.capacity() == 0) copies_.reserve(kCopiesAhead);
  if (bytes <= capacity_) return kSuccess;
  const std::uint64_t capacity = aligned(bytes);
  void* memory = nullptr;
  const CUresult status = context_.api().cuMemHostAlloc(&memory, capacity, 0);
  if (status != kSuccess) return status;
  if (first_ == copies_.size()) slabs_.clear();
  slabs_.emplace_back(context_, memory, context_.api().cuMemFreeHost);
  capacity_ = capacity;
  head_ = tail_ = 0;
  return kSuccess;
}

unsigned char* Staging::add(std::size_t bytes, void* to) {
  const std::uint64_t room = aligned(bytes);
  std::uint64_t start = head_;
  if (capacity_ != 0 && start % capacity_ + room > capacity_) start += capacity_ - start % capacity_;
  if (start + room - tail_ > capacity_) {
    if (reserve(std::max({capacity_ * 2, room * 2, kLeastSlab})) != kSuccess) return nullptr;
    start = 0;
  }
  head_ = start + room;
  unsigned char* memory = static_cast<unsigned char*>(slabs_.back().get()) + start % capacity_;
  if (copies_.size() == copies_.capacity() && first_ > 0) {  // reuse what is done before asking for more
    copies_.erase(copies_.begin(), copies_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }
  copies_.push_back({memory, bytes, to, slabs_.size(), head_});
  added_ += 1;
  return memory;
}

void Staging::complete(std::uint64_t count) {
  for (std::uint64_t done = added_ - (copies_.size() - first_); done < count; ++done) {
    const Copy& copy = copies_[first_++];
    if (copy.to != nullptr) std::memcpy(copy.to, copy.memory, copy.bytes);
    if (copy.slab == slabs_.size()) tail_ = copy.end;
  }
  if (first_ == copies_.size()) {
    copies_.clear();
    first_ = 0;
    head_ = tail_ = 0;
  }
}

}  // namespace berth::cuda
