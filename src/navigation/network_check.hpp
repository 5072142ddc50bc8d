#pragma once

#include <string>

#include "navigation/network.hpp"

namespace berth {

constexpr int kMaxChannels = 16384;
constexpr int kMaxKernel = 64;
constexpr int kMaxTensorBytes = 1 << 24;

/// Throws Error unless the layers fit together, values are within docs/network-arithmetic.md and no sum can leave 32
/// bits; the message begins with `file`.
void check_network(const Network& network, const std::string& file);

}  // namespace berth
