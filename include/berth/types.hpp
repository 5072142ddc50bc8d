#pragma once

#include <cstdint>

namespace berth {

using u8 = std::uint8_t;
using u32 = std::uint32_t;
using s32 = std::int32_t;
using u64 = std::uint64_t;

}  // namespace berth
