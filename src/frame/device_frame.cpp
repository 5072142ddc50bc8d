#include <algorithm>
#include <string>

#include "berth/error.hpp"
#include "frame/detector_parts.hpp"
#include "monotonic.hpp"
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

bool SearchResult::quad(int i, QuadCandidate& candidate, bool& found) const {
  const s32* quad = (quads_.empty() ? static_cast<const s32*>(search_.quads->host()) : quads_.data()) + i * QUAD_WORDS;
  const s32* edge = (edges_.empty() ? static_cast<const s32*>(search_.edges->host()) : edges_.data()) + i * EDGE_WORDS;
  if ((quad[0] & QUAD_VALID) == 0) return false;
  found = to_candidate(quad, edge, search_.scale, candidate);
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
  use[0] = {search_.capacity_names[0], header()[0], static_cast<u32>(g.max_run_ends)};
  use[1] = {search_.capacity_names[1], header()[1], static_cast<u32>(g.max_contours)};
  use[2] = {search_.capacity_names[2], header()[2], static_cast<u32>(g.max_points)};
}

DeviceFrame::DeviceFrame(Backend& backend, int width, int height, const DetectorConfig& config)
    : plan_(backend, width, height, config), stream_(backend.make_stream()) {
  if (plan_.frame().host() == nullptr) staging_.resize(plan_.geometry().frame_bytes());
  for (const MarkerSearch& search : plan_.searches()) searches_.emplace_back(search, !config.disc_targets.empty());
  if (!staging_.empty() && !warm_up()) {  // not in the first frame's time
    throw Error(std::string(backend.name()) + ": " + backend.device().name +
                " was lost on the first, empty frame; see berth doctor, or use another backend");
  }
}

View2D<const u8> DeviceFrame::image() {
  const MarkerGeometry& g = geometry();
  return {pixels(), g.width, g.height, g.padded_width};
}

void DeviceFrame::submit() {
  submitted_ns_ = monotonic_ns();
  if (!staging_.empty()) stream_->upload(plan_.frame(), staging_.data(), staging_.size());
  stream_->replay(plan_.plan());
  for (SearchResult& search : searches_) search.download(*stream_);
  if (staging_.empty()) done_ns_ = monotonic_ns();
}

bool DeviceFrame::finish() {
  const bool alive = stream_->finish();
  if (!staging_.empty()) done_ns_ = monotonic_ns();
  return alive;
}

bool DeviceFrame::warm_up() {
  stream_->replay(plan_.plan());
  return stream_->finish();
}

std::size_t DeviceFrame::host_bytes() const {
  std::size_t bytes = staging_.size();
  for (const SearchResult& search : searches_) bytes += search.host_bytes();
  return bytes;
}

}  // namespace berth
