#pragma once

#include <cstddef>

#include "berth/types.hpp"

namespace berth {

/// 64-bit FNV-1a over 32-bit words.
u64 digest_words(const u32* words, std::size_t count, u64 seed = 0xcbf29ce484222325u);
/// The same over a number's bits.
u64 digest_number(double value, u64 seed);

}  // namespace berth
