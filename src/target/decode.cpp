#include "target/decode.hpp"

#include <cmath>
#include <string>

#include "berth/error.hpp"
#include "target/code_match.hpp"
#include "target/layout.hpp"
#include "target/quad_map.hpp"
#include "target/reading.hpp"

namespace berth {
namespace {

// Families with the same border and the same cells, read together.
struct Group {
  Layout layout;
  std::vector<CodeMatcher> matchers;
};

struct Found {
  const CodeMatcher* matcher = nullptr;
  CodeMatch match;
};

using Match = CodeMatch (CodeMatcher::*)(const Layout&, const Reading&) const;

// The best match of a reading in any family of the group; the family named first wins a draw.
bool match_group(const Group& group, const Reading& reading, Match how, Found& found) {
  for (const CodeMatcher& matcher : group.matchers) {
    const CodeMatch match = (matcher.*how)(group.layout, reading);
    if (match.entry < 0) continue;
    if (found.matcher != nullptr && match.hamming >= found.match.hamming) continue;
    found = {&matcher, match};
  }
  return found.matcher != nullptr;
}

double mean_distance(const Reading& reading, std::size_t n) {
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += reading.value[i] < 0 ? -reading.value[i] : reading.value[i];
  return sum / static_cast<double>(n);
}

void fill(const QuadCandidate& quad, const Found& found, double margin, Detection& detection) {
  detection = Detection();
  detection.family = &found.matcher->book().family();
  detection.id = found.match.entry / 4;
  detection.hamming = found.match.hamming;
  detection.margin = margin;
  // A marker turned clockwise by `turns` has its upper left at the candidate's corner number `turns`; from there the
  // paper goes counter-clockwise and the candidate clockwise.
  const std::size_t turns = static_cast<std::size_t>(found.match.entry % 4);
  for (std::size_t i = 0; i < 4; ++i) detection.corners[i] = quad.fine[(turns + 4 - i) & 3];
  QuadMap map;
  if (map.set(quad.fine, 1, 0)) map.at(0.5, 0.5, detection.center[0], detection.center[1]);
}

// Share of a module over which a cell is averaged when its centre alone was not enough.
constexpr double kSpread = 0.6;

}  // namespace

struct Decoder::Impl {
  std::vector<Group> groups;
};

Decoder::Decoder(const std::vector<const MarkerFamily*>& families, int max_hamming) {
  if (max_hamming < 0) {
    throw Error("max_hamming: " + std::to_string(max_hamming) + " is negative; give 0 (no wrong bit) to 2");
  }
  auto impl = std::make_unique<Impl>();
  for (const MarkerFamily* family : families) {
    Group* group = nullptr;
    for (Group& known : impl->groups) {
      if (known.layout.fits(*family)) group = &known;
    }
    if (group == nullptr) {
      impl->groups.push_back({Layout(*family), {}});
      group = &impl->groups.back();
    }
    group->matchers.emplace_back(*family, group->layout, max_hamming);
  }
  impl_ = std::move(impl);
}

Decoder::~Decoder() = default;
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;

bool Decoder::decode(View2D<const u8> image, const QuadCandidate& quad, Detection& detection) const {
  for (const Group& group : impl_->groups) {
    const Layout& layout = group.layout;
    if (layout.reversed_border != quad.reversed_border) continue;
    Reading reading;
    Found found;
    const auto read = [&](const Corners& corners, double spread) {
      QuadMap map;
      return map.set(corners, layout.border_width, layout.reach) && probe_border(image, map, layout) &&
             read_cells(image, map, layout, spread, reading);
    };
    const bool readable = read(quad.fine, 0);
    bool done = readable && match_group(group, reading, &CodeMatcher::match_bits, found);
    if (!done && quad.has_fine) {
      done = read(quad.coarse, 0) && match_group(group, reading, &CodeMatcher::match_bits, found);
    }
    if (!done && readable) {
      done = read(quad.fine, kSpread) && match_group(group, reading, &CodeMatcher::match_levels, found);
    }
    if (!done) continue;
    fill(quad, found, mean_distance(reading, layout.x.size()), detection);
    return true;
  }
  return false;
}

}  // namespace berth
