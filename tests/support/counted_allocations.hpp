#pragma once

#include <cstddef>

namespace berth::test {

/// Allocations of the program so far, by any thread, C's as well as C++'s; only in tests that tests/CMakeLists.txt
/// gives counted_allocations.cpp.
std::size_t allocations();

}  // namespace berth::test
