#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

// Replaces the program's operator new: for one source of a test alone.
namespace {
std::size_t allocations = 0;
}

// Counted: the frame path must not allocate. Not inlined: seeing free() beside operator new, GCC takes them for a
// mismatch.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  ++allocations;
  if (void* memory = std::malloc(bytes)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
