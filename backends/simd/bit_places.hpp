#pragma once

#include "berth/types.hpp"

namespace berth::simd_backend {

/// The places of a byte's set bits, lowest first.
struct BitPlaces {
  u8 of[256][8];
};
constexpr BitPlaces find_bit_places() {
  BitPlaces places{};
  for (int byte = 0; byte < 256; ++byte) {
    int n = 0;
    for (int bit = 0; bit < 8; ++bit) {
      if ((byte >> bit & 1) != 0) places.of[byte][n++] = static_cast<u8>(bit);
    }
  }
  return places;
}
inline constexpr BitPlaces kBitPlaces = find_bit_places();

}  // namespace berth::simd_backend
