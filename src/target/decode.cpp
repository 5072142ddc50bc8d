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

void fill(View2D<const u8> image, const QuadCandidate& quad, const Found& found, double margin, Detection& detection) {
  detection = Detection();
  detection.family = &found.matcher->book().family();
  detection.id = found.match.entry / 4;
  detection.hamming = found.match.hamming;
  detection.margin = margin;
  // A marker turned clockwise by `turns` has its upper left at the candidate's corner number `turns`; from there the
  // paper goes counter-clockwise and the candidate clockwise.
  const std::size_t turns = static_cast<std::size_t>(found.match.entry % 4);
  std::array<SideFit, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) {
    detection.corners[i] = quad.fine[(turns + 4 - i) & 3];
    if (quad.has_fine) sides[i] = quad.sides[(turns + 3 - i) & 3];
  }
  const int border = detection.family->border_width;
  detection.corner_covariance_px2 =
      side_covariance(detection.corners, border, sides, side_blurs(image, detection.corners, border));
  QuadMap map;
  if (map.set(quad.fine, 1, 0)) map.at(0.5, 0.5, detection.center[0], detection.center[1]);
}

// Share of a module over which a cell is averaged when its centre alone was not enough.
constexpr double kSpread = 0.6;

// Rings further than this from their planes, relative to half the contrast, lie under a shadow or a glare.
constexpr double kMisfit = 0.3;

// One group's reading of one candidate, the cheapest way first.
class Attempt {
 public:
  Attempt(View2D<const u8> image, const Group& group) : image_(image), group_(group) {}

  bool read(const QuadCandidate& quad) {
    const Layout& layout = group_.layout;
    const bool fine = aim(quad.fine);
    if (fine && are_cells_even(image_, map_, layout, contrast_)) return false;
    const QuadMap fine_map = map_;
    PlaneShading planes;
    const bool has_border = fine && planes.fit(image_, map_, layout);
    const Seen first = has_border ? read_cells(image_, map_, layout, planes, 0, reading_) : Seen::no_border;
    if (first == Seen::cells && match(&CodeMatcher::match_bits)) return true;
    if (first == Seen::nothing) return false;
    if (quad.has_fine && aim(quad.coarse) && look(PlaneShading(), 0) && match(&CodeMatcher::match_bits)) return true;
    if (!fine) return false;
    map_ = fine_map;
    if (first == Seen::cells && read_cells(image_, map_, layout, planes, kSpread, reading_) == Seen::cells &&
        match(&CodeMatcher::match_levels)) {
      return true;
    }
    const bool uneven = !has_border || planes.misfit() > kMisfit;
    return uneven && look(EdgeShading(), kSpread) &&
           (match(&CodeMatcher::match_bits) || match(&CodeMatcher::match_levels));
  }

  const Found& found() const { return found_; }

  /// Mean distance of the cells from their threshold, grey levels.
  double margin() const {
    const std::size_t n = group_.layout.x.size();
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += std::fabs(reading_.value[i]);
    return sum / static_cast<double>(n);
  }

 private:
  using Match = CodeMatch (CodeMatcher::*)(const Layout&, const Reading&) const;

  bool aim(const Corners& corners) {
    if (!map_.set(corners, group_.layout.border_width, group_.layout.reach)) return false;
    contrast_ = probe_border(image_, map_, group_.layout);
    return contrast_ > 0;
  }

  template <class Shading>
  bool look(Shading shading, double spread) {
    return shading.fit(image_, map_, group_.layout) &&
           read_cells(image_, map_, group_.layout, shading, spread, reading_) == Seen::cells;
  }

  // The best match of the reading in any family of the group; the family named first wins a draw.
  bool match(Match how) {
    for (const CodeMatcher& matcher : group_.matchers) {
      const CodeMatch match = (matcher.*how)(group_.layout, reading_);
      if (match.entry < 0) continue;
      if (found_.matcher != nullptr && match.hamming >= found_.match.hamming) continue;
      found_ = {&matcher, match};
    }
    return found_.matcher != nullptr;
  }

  View2D<const u8> image_;
  const Group& group_;
  QuadMap map_;
  double contrast_ = 0;  // light less dark, as far as the border's probes tell
  Reading reading_;
  Found found_;
};

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
    if (group.layout.reversed_border != quad.reversed_border) continue;
    Attempt attempt(image, group);
    if (!attempt.read(quad)) continue;
    fill(image, quad, attempt.found(), attempt.margin(), detection);
    return true;
  }
  return false;
}

void Decoder::list_constants(std::vector<ConstantMemory>& to) const {
  add_constants("decoder", impl_->groups, to);
  for (const Group& group : impl_->groups) {
    group.layout.list_constants(to);
    add_constants("decoder", group.matchers, to);
    for (const CodeMatcher& matcher : group.matchers) matcher.book().list_constants(to);
  }
}

}  // namespace berth
