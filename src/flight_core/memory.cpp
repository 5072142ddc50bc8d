#include "flight_core/memory.hpp"

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace berth::flight_core {
namespace {

constexpr std::size_t kDefaultAlignment = __STDCPP_DEFAULT_NEW_ALIGNMENT__;

/// The texts of errors, one over the other: each is copied at the interface's edge before the next is made.
class Messages {
 public:
  void* take(std::size_t bytes, std::size_t alignment) noexcept {
    const std::size_t room = (bytes + kDefaultAlignment - 1) / kDefaultAlignment * kDefaultAlignment;
    if (room > sizeof memory_ / 4 || alignment > kDefaultAlignment) return nullptr;
    if (sizeof memory_ - used_ < room) used_ = 0;
    void* const place = memory_ + used_;
    used_ += room;
    taken_ += room;
    return place;
  }
  std::size_t taken() const { return taken_; }

 private:
  alignas(kDefaultAlignment) unsigned char memory_[8192] = {};
  std::size_t used_ = 0;
  std::size_t taken_ = 0;
};

thread_local Messages messages;
thread_local Region* in_force = nullptr;

/// What is thrown, until it is caught.
struct Thrown {
  std::atomic<bool> is_taken;
  alignas(kDefaultAlignment) unsigned char memory[1024];
};
Thrown thrown[16];

void* take(std::size_t bytes, std::size_t alignment) {
  void* const place = in_force != nullptr ? in_force->take(bytes, alignment) : messages.take(bytes, alignment);
  if (place == nullptr) throw std::bad_alloc();
  return place;
}

}  // namespace

void* Region::take(std::size_t bytes, std::size_t alignment) noexcept {
  const std::uintptr_t at = reinterpret_cast<std::uintptr_t>(next_);
  const std::size_t gap = static_cast<std::size_t>(-at & (alignment - 1));
  const std::size_t left = static_cast<std::size_t>(end_ - next_);
  if (left < gap || left - gap < bytes) return nullptr;
  void* const place = next_ + gap;
  next_ += gap + bytes;
  return place;
}

Use::Use(Region& region) noexcept : before_(in_force) { in_force = &region; }
Use::~Use() { in_force = before_; }

std::size_t message_bytes() noexcept { return messages.taken(); }

}  // namespace berth::flight_core

using berth::flight_core::kDefaultAlignment;
using berth::flight_core::take;

// The library's own, seen by nobody else: the linker makes them local (hide.cmake).
void* operator new(std::size_t bytes) { return take(bytes, kDefaultAlignment); }
void* operator new[](std::size_t bytes) { return take(bytes, kDefaultAlignment); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return take(bytes, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
  return take(bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void*) noexcept {}
void operator delete[](void*) noexcept {}
void operator delete(void*, std::size_t) noexcept {}
void operator delete[](void*, std::size_t) noexcept {}
void operator delete(void*, std::align_val_t) noexcept {}
void operator delete[](void*, std::align_val_t) noexcept {}
void operator delete(void*, std::size_t, std::align_val_t) noexcept {}
void operator delete[](void*, std::size_t, std::align_val_t) noexcept {}

namespace __gnu_cxx {
/// libstdc++'s would write the exception's name, for which it needs memory.
void __verbose_terminate_handler() { std::abort(); }
}  // namespace __gnu_cxx

// What libstdc++ calls for exceptions alone (ld --wrap).
extern "C" {
/// What a class without an implementation calls.
void __cxa_pure_virtual() { std::abort(); }

void* __wrap_malloc(std::size_t bytes) {
  using berth::flight_core::thrown;
  if (bytes > sizeof thrown[0].memory) return nullptr;
  for (auto& slot : thrown) {
    if (!slot.is_taken.exchange(true)) return slot.memory;
  }
  return nullptr;
}
void __wrap_free(void* memory) {
  for (auto& slot : berth::flight_core::thrown) {
    if (memory == slot.memory) slot.is_taken.store(false);
  }
}
}
