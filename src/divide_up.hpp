#pragma once

namespace berth {

/// Of values not below 0.
constexpr int divide_up(int value, int by) { return (value + by - 1) / by; }
constexpr int round_up(int value, int multiple) { return divide_up(value, multiple) * multiple; }

}  // namespace berth
