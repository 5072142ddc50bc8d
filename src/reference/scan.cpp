#include "reference/reference.hpp"

namespace berth::reference {

// Exclusive prefix sums of values[first … first + count) in place, and their total behind them.
void scan(const scan_params& p, u32* values) {
  u32 before = 0;
  for (int i = p.first; i < p.first + p.count; ++i) {
    const u32 value = values[i];
    values[i] = before;
    before += value;
  }
  values[p.first + p.count] = before;
}

}  // namespace berth::reference
