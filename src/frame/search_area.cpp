#include "frame/search_area.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "target/disc_finder.hpp"

namespace berth {

SearchResult::SearchResult(const MarkerSearch& search, bool with_points) : search_(search) {
  if (search.quads->host() != nullptr) return;
  if (with_points) points_.resize(search.points->bytes() / 4);
  contours_.resize(search.contours->bytes() / 4);
  quads_.resize(search.quads->bytes() / 4);
  edges_.resize(search.edges->bytes() / 4);
}

void SearchResult::download(Stream& stream) {
  if (quads_.empty()) return;
  stream.download(*search_.contours, contours_.data(), contours_.size() * 4);
  stream.download(*search_.quads, quads_.data(), quads_.size() * 4);
  stream.download(*search_.edges, edges_.data(), edges_.size() * 4);
  if (!points_.empty()) stream.download(*search_.points, points_.data(), points_.size() * 4);
}

const u32* SearchResult::header() const {
  return contours_.empty() ? static_cast<const u32*>(search_.contours->host()) : contours_.data();
}

int SearchResult::slots() const {
  return static_cast<int>(std::min(header()[1], static_cast<u32>(search_.geometry.max_contours)));
}

bool SearchResult::quad(int i, int x, int y, QuadCandidate& candidate, bool& found) const {
  const s32* quad = (quads_.empty() ? static_cast<const s32*>(search_.quads->host()) : quads_.data()) + i * QUAD_WORDS;
  const s32* edge = (edges_.empty() ? static_cast<const s32*>(search_.edges->host()) : edges_.data()) + i * EDGE_WORDS;
  if ((quad[0] & QUAD_VALID) == 0) return false;
  found = to_candidate(quad, edge, search_.scale, x, y, candidate);
  return true;
}

void SearchResult::add_outlines(DiscFinder& finder) const {
  const u32* const points = points_.empty() ? static_cast<const u32*>(search_.points->host()) : points_.data();
  for (int i = 0; i < slots(); ++i) {
    const u32* const record = header() + CONTOUR_HEADER + i * CONTOUR_WORDS;
    if ((record[1] & CONTOUR_HOLE) != 0) continue;
    finder.add_outline(points + record[3], static_cast<int>(record[1]), search_.scale);
  }
}

void SearchResult::note_capacities(CapacityUse* use) const {
  const MarkerGeometry& g = search_.geometry;
  const int room[] = {g.max_run_ends, g.max_contours, g.max_points};
  for (std::size_t i = 0; i < 3; ++i) {
    const CapacityUse here = {search_.capacity_names[i], header()[i], static_cast<u32>(room[i])};
    const bool is_tighter = u64{here.needed} * use[i].capacity > u64{use[i].needed} * here.capacity;
    if (use[i].capacity == 0 || is_tighter) use[i] = here;
  }
}

SearchArea::SearchArea(MarkerPlan&& made, bool with_points) : plan(std::move(made)) {
  for (const MarkerSearch& search : plan.searches()) searches.emplace_back(search, with_points);
  if (plan.frame().host() == nullptr) staging_.resize(plan.geometry().frame_bytes());
  if (plan.gains() != nullptr && plan.gains()->host() == nullptr) gain_staging_.resize(plan.gains()->bytes() / 2);
}

void SearchArea::enqueue(Stream& stream) {
  if (is_staged()) stream.upload(plan.frame(), staging_.data(), staging_.size());
  stream.replay(place.full_resolution_only ? plan.full_resolution_plan() : plan.plan());
  for (std::size_t i = 0; i < searched(); ++i) searches[i].download(stream);
}

void SearchArea::enqueue_window(View2D<const u8> frame, const FrameLevels& levels, Stream& stream) {
  pad_frame({frame.row(place.y) + place.x, place.side, place.side, frame.stride}, plan.geometry(), pixels());
  for (std::size_t scale = 0; scale < (place.full_resolution_only ? 1 : 2); ++scale) {
    stream.upload(plan.levels(scale), levels.levels(scale).data(), sizeof(FrameLevels::Words));
  }
  if (plan.gains() != nullptr) enqueue_gains(levels, stream);
  enqueue(stream);
}

/// The window's part of the frame's gains.
void SearchArea::enqueue_gains(const FrameLevels& levels, Stream& stream) {
  void* const host = plan.gains()->host();
  u8* to = host != nullptr ? static_cast<u8*>(host) : reinterpret_cast<u8*>(gain_staging_.data());
  const std::size_t row_bytes = static_cast<std::size_t>(place.side) * 2;
  const std::size_t stride = static_cast<std::size_t>(plan.geometry().padded_width) * 2;
  for (int y = 0; y < place.side; ++y, to += stride) {
    std::memcpy(to, levels.gains_at(place.x, place.y + y), row_bytes);
  }
  if (host == nullptr) stream.upload(*plan.gains(), gain_staging_.data(), plan.gains()->bytes());
}

std::size_t SearchArea::host_bytes() const {
  std::size_t bytes = staging_.size() + gain_staging_.size() * 2;
  for (const SearchResult& search : searches) bytes += search.host_bytes();
  return bytes;
}

}  // namespace berth
