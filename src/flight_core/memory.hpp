#pragma once

// Where the flight core's objects lie. In libberth-core.a operator new is memory.cpp's and malloc is nobody's: there is
// the region in force, and a little room for what is thrown.

#include <cstddef>

namespace berth::flight_core {

/// Memory handed out from its beginning on and never taken back.
class Region {
 public:
  constexpr Region() = default;
  Region(void* memory, std::size_t bytes)
      : begin_(static_cast<unsigned char*>(memory)), next_(begin_), end_(begin_ + bytes) {}

  /// Null where there is not so much left. `alignment`: a power of two.
  void* take(std::size_t bytes, std::size_t alignment) noexcept;
  std::size_t taken() const { return static_cast<std::size_t>(next_ - begin_); }

 private:
  unsigned char* begin_ = nullptr;
  unsigned char* next_ = nullptr;
  unsigned char* end_ = nullptr;
};

/// Puts a region in force on this thread while it lives; the one before comes back after it.
class Use {
 public:
  explicit Use(Region& region) noexcept;
  ~Use();
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;

 private:
  Region* before_;
};

/// What this thread has taken where no region was in force, for the texts of errors.
std::size_t message_bytes() noexcept;

}  // namespace berth::flight_core
