// Extrema of tiles of 4 × 4 pixels in vectors: for each instruction set, so without an include guard of the usual kind.
#if defined(BERTH_TILE_EXTREMA_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef BERTH_TILE_EXTREMA_INL
#undef BERTH_TILE_EXTREMA_INL
#else
#define BERTH_TILE_EXTREMA_INL
#endif

#include <hwy/highway.h>

#include "berth/types.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {

#if HWY_TARGET != HWY_SCALAR

/// Writes the least and the greatest pixel of every tile of four rows: the rows at once, then the four bytes of each
/// word.
template <class Bytes, class Row>
HWY_INLINE void store_tile_extrema(Bytes bytes, Row a, Row b, Row c, Row d, u8* minima, u8* maxima) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::Repartition<u32, Bytes> words;
  const hn::Rebind<u8, decltype(words)> tiles;
  auto least = hn::Min(hn::Min(a, b), hn::Min(c, d));
  auto most = hn::Max(hn::Max(a, b), hn::Max(c, d));
  least = hn::Min(least, hn::BitCast(bytes, hn::ShiftRight<16>(hn::BitCast(words, least))));
  most = hn::Max(most, hn::BitCast(bytes, hn::ShiftRight<16>(hn::BitCast(words, most))));
  least = hn::Min(least, hn::BitCast(bytes, hn::ShiftRight<8>(hn::BitCast(words, least))));
  most = hn::Max(most, hn::BitCast(bytes, hn::ShiftRight<8>(hn::BitCast(words, most))));
  hn::StoreU(hn::TruncateTo(tiles, hn::BitCast(words, least)), tiles, minima);
  hn::StoreU(hn::TruncateTo(tiles, hn::BitCast(words, most)), tiles, maxima);
}

#endif

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
