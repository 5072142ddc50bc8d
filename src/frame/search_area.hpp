#pragma once

#include <cstdint>
#include <vector>

#include "frame/frame_levels.hpp"
#include "frame/marker_plan.hpp"
#include "frame/quads.hpp"

namespace berth {

class DiscFinder;

/// One search's results on the host: in the device's memory where the host reaches it, downloaded otherwise.
class SearchResult {
 public:
  /// `with_points`: the contours' points too.
  SearchResult(const MarkerSearch& search, bool with_points);
  void download(Stream& stream);

  /// How many slots the frame has filled, and how many there are.
  int slots() const;
  int capacity() const { return search_.geometry.max_contours; }
  /// Whether slot i holds a quadrilateral; `found` tells whether it has four corners. The image searched begins at
  /// (x, y) of the frame.
  bool quad(int i, int x, int y, QuadCandidate& candidate, bool& found) const;
  /// Gives the outlines of dark regions to `finder`; only where the points are there.
  void add_outlines(DiscFinder& finder) const;
  /// Where it leaves less room than `use` says.
  void note_capacities(CapacityUse* use) const;
  std::size_t host_bytes() const { return (contours_.size() + quads_.size() + edges_.size() + points_.size()) * 4; }

 private:
  const u32* header() const;

  const MarkerSearch& search_;
  std::vector<u32> contours_;
  std::vector<s32> quads_;
  std::vector<s32> edges_;
  std::vector<u32> points_;
};

/// A frame's or a window's plan, with its results and what goes up and down where the host does not reach the device's
/// memory.
class SearchArea {
 public:
  /// `with_points`: as SearchResult.
  explicit SearchArea(MarkerPlan&& made, bool with_points = false);
  SearchArea(const SearchArea&) = delete;
  SearchArea& operator=(const SearchArea&) = delete;

  bool is_staged() const { return !staging_.empty(); }
  /// The padded pixels: u8[padded_height, padded_width].
  u8* pixels() { return staging_.empty() ? static_cast<u8*>(plan.frame().host()) : staging_.data(); }
  /// How many of the searches are made of what lies in `place`.
  std::size_t searched() const { return place.full_resolution_only ? 1 : searches.size(); }
  /// Enqueues what was written to pixels().
  void enqueue(Stream& stream);
  /// Enqueues a window at `place` of the frame, with its levels.
  void enqueue_window(View2D<const u8> frame, const FrameLevels& levels, Stream& stream);
  std::size_t host_bytes() const;

  MarkerPlan plan;
  std::vector<SearchResult> searches;
  /// Where it lies in the frame.
  SearchWindow place;

 private:
  void enqueue_gains(const FrameLevels& levels, Stream& stream);

  std::vector<u8> staging_;  // empty where the host reaches the device's memory
  std::vector<std::uint16_t> gain_staging_;
};

}  // namespace berth
