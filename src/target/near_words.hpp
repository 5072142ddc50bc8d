#pragma once

#include <cstddef>

#include "berth/types.hpp"

namespace berth {

/// Which of the first `count` (64 at most) words differ from `seen` in no more than `distance` bits: bit i for
/// words[i].
u64 near_words(const u64* words, std::size_t count, u64 seen, int distance);

}  // namespace berth
