// Lanes picked from vectors of words: for each instruction set, so without an include guard of the usual kind.
#if defined(BERTH_SIMD_CHOOSE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef BERTH_SIMD_CHOOSE_INL
#undef BERTH_SIMD_CHOOSE_INL
#else
#define BERTH_SIMD_CHOOSE_INL
#endif

#include <hwy/highway.h>

#include "simd/bit_places.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Some lanes of vectors of u32. Highway's own Compress (1.0.3) copies its table to the stack each time where the
/// processor has no instruction for it.
template <class D>
class Choice {
 public:
  HWY_INLINE explicit Choice(hn::Mask<D> mask) {
#if HWY_TARGET <= HWY_AVX3
    mask_ = mask;
    count_ = static_cast<int>(hn::CountTrue(D(), mask));
#else
    u8 bits[8] = {};
    hn::StoreMaskBits(D(), mask, bits);
    bits_ = bits[0];
    count_ = __builtin_popcount(bits_);
#if HWY_TARGET == HWY_AVX2
    const hn::Rebind<u8, D> places;
    indices_ = hn::BitCast(D(), hn::PromoteTo(D(), hn::LoadU(places, kBitPlaces.of[bits_])));
#endif
#endif
  }

  int count() const { return count_; }

  /// Writes the chosen lanes, and something behind them up to a vector's length.
  HWY_INLINE void store(hn::Vec<D> v, u32* out) const {
#if HWY_TARGET <= HWY_AVX3
    hn::StoreU(hn::Compress(v, mask_), D(), out);
#elif HWY_TARGET == HWY_AVX2
    hn::StoreU(hn::TableLookupLanes(v, hn::IndicesFromVec(D(), indices_)), D(), out);
#else
    u32 lanes[HWY_MAX_BYTES / sizeof(u32)];
    hn::StoreU(v, D(), lanes);
    for (int i = 0; i < count_; ++i) out[i] = lanes[kBitPlaces.of[bits_][i]];
#endif
  }

 private:
  int count_;
#if HWY_TARGET <= HWY_AVX3
  hn::Mask<D> mask_;
#else
  unsigned bits_;
#if HWY_TARGET == HWY_AVX2
  hn::Vec<D> indices_;
#endif
#endif
};

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
