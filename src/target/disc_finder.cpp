#include "target/disc_finder.hpp"

#include <algorithm>

#include "berth/error.hpp"

namespace berth {
namespace {

// Outlines whose centres are this near, as a share of the shorter half axis, are of one disc: a ring's hole is no
// outline, so that nothing else has that centre.
constexpr double kSame = 0.5;

bool same_place(const Ellipse& a, const Ellipse& b) {
  const double dx = a.center[0] - b.center[0], dy = a.center[1] - b.center[1];
  return dx * dx + dy * dy < kSame * kSame * std::min(a.axes_squared()[0], b.axes_squared()[0]);
}

/// A total order: the larger first, then from above, then from the left.
bool comes_before(const Ellipse& a, const Ellipse& b) {
  const double size_a = a.determinant(), size_b = b.determinant();
  if (size_a != size_b) return size_a > size_b;
  if (a.center[1] != b.center[1]) return a.center[1] < b.center[1];
  return a.center[0] < b.center[0];
}

}  // namespace

DiscFinder::DiscFinder(const std::vector<DiscTarget>& targets, const CameraModel& camera)
    : camera_(camera), fit_(camera) {
  for (const DiscTarget& target : targets) {
    for (const DiscMatcher& other : matchers_) {
      if (other.target().name == target.name) {
        throw Error("two targets are named \"" + target.name + "\"; give each a name of its own");
      }
    }
    matchers_.emplace_back(target);
  }
  outlines_.reserve(kMostOutlines);
  discs_.reserve(DiscMatcher::kMostSeen);
}

void DiscFinder::add_outline(const u32* points, int count, int scale) {
  Ellipse outline;
  if (!outline_ellipse(points, count, scale, outline)) return;
  // A heap, whose first is the last in order.
  const bool is_full = outlines_.size() == kMostOutlines;
  if (is_full && !comes_before(outline, outlines_.front())) return;
  for (const Ellipse& known : outlines_) {
    if (same_place(known, outline)) return;
  }
  if (is_full) {
    std::pop_heap(outlines_.begin(), outlines_.end(), comes_before);
    outlines_.pop_back();
  }
  outlines_.push_back(outline);
  std::push_heap(outlines_.begin(), outlines_.end(), comes_before);
}

void DiscFinder::find(View2D<const u8> image, std::vector<DiscPose>& results) {
  std::sort(outlines_.begin(), outlines_.end(), comes_before);
  discs_.clear();
  const std::size_t most = std::min(outlines_.size(), kMostMeasured);
  FittedDisc disc;
  for (std::size_t i = 0; i < most && discs_.size() < DiscMatcher::kMostSeen; ++i) {
    if (fit_.fit(image, outlines_[i], disc)) discs_.push_back(disc);
  }
  for (std::size_t i = 0; i < matchers_.size(); ++i) {
    matchers_[i].find(camera_, image, discs_.data(), discs_.size(), results[i]);
  }
}

}  // namespace berth
