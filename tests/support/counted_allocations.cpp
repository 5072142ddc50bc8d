#include "support/counted_allocations.hpp"

#include <atomic>
#include <cerrno>
#include <cstdlib>

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define BERTH_SANITIZED 1
#endif
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define BERTH_SANITIZED 1
#endif

namespace {
std::atomic<std::size_t> count = 0;
}

std::size_t berth::test::allocations() { return count; }

#ifdef BERTH_SANITIZED

// The sanitizers replace malloc and operator new themselves, and tell whoever asks. Clang's
// sanitizer/allocator_interface.h says so; GCC has the function but not the header.
// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void* memory,
                                                                           std::size_t bytes),
                                                         void (*on_free)(const volatile void* memory));
namespace {
const int hooked = __sanitizer_install_malloc_and_free_hooks([](const volatile void*, std::size_t) { ++count; },
                                                             [](const volatile void*) {});
}

#else

// The C library's own, under the names that it gives them for those who replace malloc; operator new ends here too.
extern "C" {
void* libc_malloc(std::size_t bytes) __asm__("__libc_malloc");
void* libc_calloc(std::size_t items, std::size_t bytes) __asm__("__libc_calloc");
void* libc_realloc(void* memory, std::size_t bytes) __asm__("__libc_realloc");
void* libc_memalign(std::size_t alignment, std::size_t bytes) __asm__("__libc_memalign");

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name): stdlib.h's are reserved
void* malloc(std::size_t bytes) {
  ++count;
  return libc_malloc(bytes);
}
void* calloc(std::size_t items, std::size_t bytes) {
  ++count;
  return libc_calloc(items, bytes);
}
void* realloc(void* memory, std::size_t bytes) {
  ++count;
  return libc_realloc(memory, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  ++count;
  return libc_memalign(alignment, bytes);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  *memory = aligned_alloc(alignment, bytes);
  return *memory == nullptr ? ENOMEM : 0;
}
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
}

#endif
