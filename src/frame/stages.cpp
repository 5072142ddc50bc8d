#include "frame/stages.hpp"

#include <algorithm>

namespace berth {

StageReader::StageReader(MarkerPlan& plan, Stream& stream, bool full_resolution_only) : plan_(plan), stream_(stream) {
  const auto is_made = [&](const Stage& stage) { return !full_resolution_only || stage.search == 0; };
  stages_ = static_cast<std::size_t>(std::count_if(plan.stages().begin(), plan.stages().end(), is_made));
  for (const MarkerSearch& search : plan.searches()) {
    searches_.emplace_back();
    fetch(*search.contours, searches_.back().contours);
    fetch(*search.quads, searches_.back().quads);
  }
}

std::size_t StageReader::fetch(Buffer& buffer, std::vector<u32>& words) {
  words.resize(buffer.bytes() / 4);
  stream_.download(buffer, words.data(), buffer.bytes());
  stream_.finish();
  return words.size();
}

const std::vector<u32>& StageReader::read(std::size_t index) {
  const Stage& stage = plan_.stages()[index];
  const std::vector<u32>& contours = searches_[stage.search].contours;
  const std::vector<u32>& found_quads = searches_[stage.search].quads;
  const std::size_t slots = static_cast<std::size_t>(plan_.searches()[stage.search].geometry.max_contours);
  const std::size_t size = fetch(*stage.buffer, words_);
  switch (stage.length) {
    case Stage::Length::whole:
      break;
    case Stage::Length::run_ends:  // in overflow the last rows are missing, which the offsets' stage shows
      words_.resize(contours[0] <= size ? contours[0] : 0);
      break;
    case Stage::Length::points: {
      std::size_t used = 0;
      for (std::size_t i = 0; i < slots; ++i) {
        const u32* record = contours.data() + CONTOUR_HEADER + i * CONTOUR_WORDS;
        const std::size_t nodes = record[1] & ~CONTOUR_HOLE;
        if (nodes > 0) used = std::max(used, record[3] + nodes);
      }
      words_.resize(std::min(size, used));
      break;
    }
    case Stage::Length::quads:
    case Stage::Length::edges: {
      const bool quads = stage.length == Stage::Length::quads;
      const std::size_t width = quads ? QUAD_WORDS : EDGE_WORDS;
      for (std::size_t i = 0; i < slots; ++i) {
        if (found_quads[i * QUAD_WORDS] != 0) continue;
        std::fill_n(words_.begin() + static_cast<std::ptrdiff_t>(i * width), width, 0u);
      }
      break;
    }
  }
  return words_;
}

std::optional<StageDifference> first_difference(StageReader& first, StageReader& second) {
  const std::vector<Stage>& stages = first.plan().stages();
  for (std::size_t i = 0; i < first.stages(); ++i) {
    const std::vector<u32>& a = first.read(i);
    const std::vector<u32>& b = second.read(i);
    if (a == b) continue;
    const std::size_t shorter = std::min(a.size(), b.size());
    const auto at = std::mismatch(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(shorter), b.begin());
    StageDifference difference;
    difference.stage = stages[i].name;
    difference.word = static_cast<std::size_t>(at.first - a.begin());
    if (at.first != a.end()) difference.first = *at.first;
    if (at.second != b.end()) difference.second = *at.second;
    return difference;
  }
  return std::nullopt;
}

}  // namespace berth
