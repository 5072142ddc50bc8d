#pragma once

#include <cstddef>
#include <vector>

namespace berth {

/// Memory that nobody writes between start and end, so that it can be checked meanwhile.
struct ConstantMemory {
  /// "code book"
  const char* what = "";
  const void* data = nullptr;
  std::size_t bytes = 0;
};

/// Adds what a vector holds.
template <class T>
void add_constants(const char* what, const std::vector<T>& values, std::vector<ConstantMemory>& to) {
  if (!values.empty()) to.push_back({what, values.data(), values.size() * sizeof(T)});
}

}  // namespace berth
