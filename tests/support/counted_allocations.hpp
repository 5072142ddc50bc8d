#pragma once

#include <cstddef>

namespace berth::test {

/// Allocations of the program so far; only in tests that tests/CMakeLists.txt gives counted_allocations.cpp.
std::size_t allocations();

}  // namespace berth::test
