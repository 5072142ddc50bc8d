#include <algorithm>
#include <tuple>

#include "target/decode.hpp"

namespace berth {
namespace {

double doubled_area(const Detection& d) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& a = d.corners[i];
    const auto& b = d.corners[(i + 1) & 3];
    sum += a[0] * b[1] - a[1] * b[0];
  }
  return sum < 0 ? -sum : sum;
}

// Whether the point lies in the quadrilateral (its corners run counter-clockwise on the screen).
bool covers(const Detection& d, const std::array<double, 2>& p) {
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& a = d.corners[i];
    const auto& b = d.corners[(i + 1) & 3];
    if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) return false;
  }
  return true;
}

// One marker found twice, or two readings of one place; but a small marker printed inside a large one is a marker of
// its own (tagCustom48h12 leaves its middle free for that).
bool same_place(const Detection& a, const Detection& b) {
  const bool a_covers = covers(a, b.center), b_covers = covers(b, a.center);
  if (a.family == b.family && a.id == b.id) return a_covers || b_covers;
  const double area_a = doubled_area(a), area_b = doubled_area(b);
  return a_covers && b_covers && std::min(area_a, area_b) >= 0.25 * std::max(area_a, area_b);
}

auto place(const Detection& d) { return std::tie(d.corners, d.center); }

// Best first. A total order: what compares equal is equal in every field that is printed. The earlier search comes
// before the margin, so that what it read without a wrong bit stands, whatever later ones find.
bool better(const Detection& a, const Detection& b) {
  if (a.hamming != b.hamming) return a.hamming < b.hamming;
  if (a.search != b.search) return a.search < b.search;
  if (a.margin != b.margin) return a.margin > b.margin;
  const double area_a = doubled_area(a), area_b = doubled_area(b);
  if (area_a != area_b) return area_a > area_b;
  if (place(a) != place(b)) return place(a) < place(b);
  if (a.family->name != b.family->name) return a.family->name < b.family->name;
  return a.id < b.id;
}

bool listed_before(const Detection& a, const Detection& b) {
  if (a.family->name != b.family->name) return a.family->name < b.family->name;
  if (a.id != b.id) return a.id < b.id;
  return place(a) < place(b);
}

}  // namespace

void resolve_duplicates(std::vector<Detection>& detections) {
  std::sort(detections.begin(), detections.end(), better);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    bool hidden = false;
    for (std::size_t k = 0; k < kept; ++k) hidden = hidden || same_place(detections[k], detections[i]);
    if (!hidden) detections[kept++] = detections[i];
  }
  detections.resize(kept);
  std::sort(detections.begin(), detections.end(), listed_before);
}

}  // namespace berth
