// Sums of products of pixels' channels (NodeBlock), for each instruction set, so without an include guard of the usual
// kind.
#include <algorithm>

#include "target/node_block.hpp"

#if defined(BERTH_NODE_SUMS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef BERTH_NODE_SUMS_INL
#undef BERTH_NODE_SUMS_INL
#else
#define BERTH_NODE_SUMS_INL
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {

#if HWY_TARGET != HWY_SCALAR
namespace hn = hwy::HWY_NAMESPACE;

using D16 = hn::CappedTag<std::int16_t, 32>;
using D32 = hn::RepartitionToWide<D16>;
using V16 = hn::Vec<D16>;
using V32 = hn::Vec<D32>;
using Bytes = hn::Repartition<std::uint8_t, D16>;
constexpr std::size_t kLanes = hn::MaxLanes(D16());
constexpr std::size_t kVectorRows = kLanes / 8;
static_assert(kVectorRows == 1 || kVectorRows == 2 || kVectorRows == 4, "of a block's 4 or 8 rows");

// Which products go to which lanes is the processor's choice: it is for sums that end as totals.
HWY_INLINE V32 add_products(V32 sums, V16 a, V16 b) {
  V32 more = hn::Zero(D32());
  sums = hn::ReorderWidenMulAccumulate(D32(), a, b, sums, more);
  return hn::Add(sums, more);
}

// Pixels' channels, vector by vector: of those that see edges, and three of those that see none. A vector more than
// there are is written to.
struct Stored {
  static constexpr std::size_t kMost = NodeBlocks::kMost * 64 + kLanes;
  alignas(64) std::int16_t edges[kChannels][kMost];
  alignas(64) std::int16_t even[3][kMost];
  std::size_t edge_vectors = 0, even_vectors = 0;
};

// Sums of four lanes each, which end as totals.
struct LaneSums {
  alignas(64) std::int32_t rows[PlaceSums::kRows][4];

  HWY_INLINE LaneSums() {
    const hn::CappedTag<std::int32_t, 16> d;
    for (std::size_t k = 0; k < PlaceSums::kRows; k += hn::Lanes(d) / 4) hn::Store(hn::Zero(d), d, rows[k]);
  }
  template <class V>
  HWY_INLINE void add(std::size_t row, V sums) {
    const hn::DFromV<V> d;
    if constexpr (hn::MaxLanes(d) > 4) {
      const hn::Half<decltype(d)> half;
      add(row, hn::Add(hn::LowerHalf(half, sums), hn::UpperHalf(half, sums)));
    } else {
      hn::Store(hn::Add(hn::Load(d, rows[row]), sums), d, rows[row]);
    }
  }
  HWY_INLINE void add_totals_to(PlaceSums& sums) const {
    const hn::CappedTag<std::int32_t, 4> d;
    const hn::Repartition<std::int64_t, decltype(d)> d64;
    for (std::size_t k = 0; k < PlaceSums::kRows; k += 4) {
      const auto both = [&](std::size_t a) HWY_ATTR {
        const auto p = hn::Load(d, rows[a]), q = hn::Load(d, rows[a + 1]);
        return hn::BitCast(d64, hn::Add(hn::InterleaveLower(d, p, q), hn::InterleaveUpper(d, p, q)));
      };
      const auto p = both(k), q = both(k + 2);
      const auto totals =
          hn::Add(hn::BitCast(d, hn::InterleaveLower(d64, p, q)), hn::BitCast(d, hn::InterleaveUpper(d64, p, q)));
      std::int32_t* const to = sums.rows.data() + k;
      hn::Store(hn::Add(hn::Load(d, to), totals), d, to);
    }
  }
};

template <std::size_t kVectors>
HWY_INLINE void sum_edges(const Stored& stored, std::size_t first, LaneSums& sums) {
  std::size_t k = 0;
  for (std::size_t a = 0; a < kChannels; ++a) {
    V16 left[kVectors];
    for (std::size_t i = 0; i < kVectors; ++i) left[i] = hn::Load(D16(), stored.edges[a] + first + i * kLanes);
    for (std::size_t b = a; b < kChannels; ++b, ++k) {
      V32 sum = hn::Zero(D32());
      for (std::size_t i = 0; i < kVectors; ++i) {
        sum = add_products(sum, left[i], hn::Load(D16(), stored.edges[b] + first + i * kLanes));
      }
      sums.add(k, sum);
    }
  }
}

// Eight vectors at a time, so that their number is a constant.
HWY_INLINE void sum_edges(const Stored& stored, LaneSums& sums) {
  constexpr std::size_t kAtOnce = 8;
  for (std::size_t done = 0; done < stored.edge_vectors; done += kAtOnce) {
    const std::size_t first = done * kLanes;
    switch (std::min(kAtOnce, stored.edge_vectors - done)) {
      case 1:
        sum_edges<1>(stored, first, sums);
        break;
      case 2:
        sum_edges<2>(stored, first, sums);
        break;
      case 3:
        sum_edges<3>(stored, first, sums);
        break;
      case 4:
        sum_edges<4>(stored, first, sums);
        break;
      case 5:
        sum_edges<5>(stored, first, sums);
        break;
      case 6:
        sum_edges<6>(stored, first, sums);
        break;
      case 7:
        sum_edges<7>(stored, first, sums);
        break;
      default:
        sum_edges<kAtOnce>(stored, first, sums);
        break;
    }
  }
}

HWY_INLINE void sum_even(const Stored& stored, LaneSums& sums) {
  constexpr std::size_t kRow[6] = {0, 1, kResidual, kChannels, kChannels + kResidual - 1, kProducts - 1};
  std::size_t k = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a; b < 3; ++b, ++k) {
      V32 sum = hn::Zero(D32());
      for (std::size_t i = 0; i < stored.even_vectors; ++i) {
        sum = add_products(sum, hn::Load(D16(), stored.even[a] + i * kLanes),
                           hn::Load(D16(), stored.even[b] + i * kLanes));
      }
      sums.add(kRow[k], sum);
    }
  }
}
#endif

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
