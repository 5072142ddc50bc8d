// Rows of a bit plane, a word a lane: for each instruction set, so without an include guard of the usual kind.
#if defined(BERTH_SIMD_BIT_ROWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef BERTH_SIMD_BIT_ROWS_INL
#undef BERTH_SIMD_BIT_ROWS_INL
#else
#define BERTH_SIMD_BIT_ROWS_INL
#endif

#include <hwy/highway.h>

#include "berth/types.hpp"
#include "reference/layout.hpp"
#include "simd/workspace.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using RowTag = hn::ScalableTag<u32>;
using RowWords = hn::Vec<RowTag>;

HWY_INLINE int row_lanes() { return static_cast<int>(hn::Lanes(RowTag())); }
HWY_INLINE u32 popcount(u32 word) { return static_cast<u32>(__builtin_popcount(word)); }

/// Words from x on of a row, 0 past its end. May read a vector past the row, as the buffers of CPU backends allow.
HWY_INLINE RowWords row_words_at(const u32* row, int x, int row_words) {
  const RowTag words;
  const auto here = hn::LoadU(words, row + x);
  if (x + row_lanes() <= row_words) return here;
  return hn::IfThenElseZero(hn::FirstN(words, static_cast<std::size_t>(row_words - x)), here);
}

/// Moves a row's bits one pixel to the right, vector after vector from its first on: in registers, as what was just
/// stored cannot be loaded at another place without a wait.
class RightMover {
 public:
  HWY_INLINE RightMover()
      : before_(hn::Zero(RowTag())),
        first_(hn::FirstN(RowTag(), 1)),
        turn_(hn::IndicesFromVec(RowTag(), hn::And(hn::Add(hn::Iota(RowTag(), 0), last()), last()))) {}

  HWY_INLINE RowWords moved(RowWords here) {
    const RowWords turned = hn::TableLookupLanes(here, turn_);
    const RowWords before = hn::IfThenElse(first_, before_, turned);
    before_ = turned;
    return hn::Or(hn::ShiftLeft<1>(here), hn::ShiftRight<31>(before));
  }

 private:
  static HWY_INLINE RowWords last() { return hn::Set(RowTag(), static_cast<u32>(row_lanes() - 1)); }

  RowWords before_;  // its first lane is the word before the next vector
  hn::Mask<RowTag> first_;
  decltype(hn::IndicesFromVec(RowTag(), hn::Zero(RowTag()))) turn_;
};

/// How many rows fit whole into the capacity of run ends.
template <class P>
HWY_INLINE int kept_rows(const P& p, const u32* offsets) {
  const auto fit = [&](int rows) {
    return reference::run_ends_before(offsets, p.base_at, rows * p.row_words) <= static_cast<u32>(p.capacity);
  };
  if (fit(p.height)) return p.height;
  int low = 0;
  for (int high = p.height; high - low > 1;) {
    const int middle = (low + high) / 2;
    (fit(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
