#pragma once

// What operations with row code work in beside their buffers. A stream has one, so that frames allocate nothing and no
// thread keeps what another frame needs.

#include <algorithm>
#include <cstddef>
#include <vector>

#include "berth/ops.hpp"
#include "berth/types.hpp"

namespace berth::simd_backend {

/// Words in the widest row (16384 px), and the most that a vector has.
constexpr int kMaxRowWords = 512;
constexpr int kRowSlack = 64;

/// run_link: words in which overlaps begin: where, the changes of the rows above and here, and the ids of the last run
/// ends before the word.
struct OverlapWords {
  static constexpr int kRoom = 1024;
  static constexpr int kSize = kRoom + kMaxRowWords + kRowSlack;
  u32 begins[kSize];
  u32 above[kSize];
  u32 here[kSize];
  u32 up[kSize];
  u32 low[kSize];
};

/// run_link: overlaps in raster order, by the starts of their runs; the one before the first is kept in front.
struct Overlaps {
  static constexpr int kBatch = 2;
  static constexpr int kSize = 1 + OverlapWords::kSize * 16 + kRowSlack;
  u32 up[kSize];
  u32 low[kSize];
};

/// contour_measure: some walk from a top; its path has room for the longest, and a vector.
struct Walk {
  int first;
  int y;
  u32 stamp;
  u32 row_begin;
  std::ptrdiff_t id;
  int count;
  std::vector<u32> ids, nodes;
};

/// contour_measure.
struct WalkMemory {
  // By which walk a node was last seen. A frame's stamps rise from top to top and lie below those of all earlier
  // frames, so nothing needs to be wiped.
  std::vector<u32> stamps;
  u32 least_stamp = ~0u;
  std::vector<u32> row_begins;  // the first run end of every row, and of the one after the last
  std::vector<u32> tops;
  Walk walks[2];

  void make_room(const contour_measure_params& p, std::size_t most_nodes) {
    constexpr std::size_t kOverhang = 64;
    const auto grow = [](auto& list, std::size_t room, u32 value) {
      if (list.size() < room) list.resize(room, value);
    };
    const std::size_t capacity = static_cast<std::size_t>(p.capacity);
    grow(stamps, capacity, ~0u);
    grow(row_begins, static_cast<std::size_t>(p.height) + 1, 0);
    grow(tops, capacity / 2 + kOverhang, 0);
    for (Walk& walk : walks) {
      grow(walk.ids, most_nodes + kOverhang, 0);
      grow(walk.nodes, most_nodes + kOverhang, 0);
    }
  }

  /// The first of that many stamps.
  u32 take_stamps(u32 count) {
    if (least_stamp <= count) {
      std::fill(stamps.begin(), stamps.end(), ~0u);
      least_stamp = ~0u;
    }
    least_stamp -= count;
    return least_stamp;
  }
};

/// threshold: extrema over 3 × 3 tiles need a tile beyond either end of the row: the outermost once more.
struct TileRow {
  static constexpr std::size_t kMaxTiles = 4096;  // in a row of 16384 px
  static constexpr std::size_t kMargin = 64;
  alignas(64) u8 low[kMaxTiles + 2 * kMargin];
  alignas(64) u8 high[kMaxTiles + 2 * kMargin];
  alignas(64) u8 limit[kMaxTiles + 2 * kMargin];
};

/// quad_fit: points of one contour, twice over so that arcs may pass the first point, with room for a vector's
/// overhang.
struct ContourPoints {
  std::vector<s32> x;
  std::vector<s32> y;  // row centres

  void make_room(int most) {
    const std::size_t room = static_cast<std::size_t>(most) * 2 + 64;
    if (x.size() >= room) return;
    x.resize(room);
    y.resize(room);
  }
};

struct Workspace {
  TileRow tiles;
  OverlapWords overlap_words;
  Overlaps overlaps;
  WalkMemory walks;
  ContourPoints points;
};

}  // namespace berth::simd_backend
