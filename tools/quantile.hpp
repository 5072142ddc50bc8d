#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace berth::cli {

/// The value below which `share` of them lie, one of them; 0 of none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

}  // namespace berth::cli
