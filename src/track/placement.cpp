#include "track/placement.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace berth {
namespace {

Box united(const Box& a, const Box& b) {
  return {std::min(a.left, b.left), std::min(a.top, b.top), std::max(a.right, b.right), std::max(a.bottom, b.bottom)};
}

double pixels(int side) { return static_cast<double>(side) * side; }

int step_down(double v) { return static_cast<int>(std::floor(v / kWindowStep)) * kWindowStep; }

/// Where a window of `side` begins that covers [low, high] and lies in [0, size), as near as may be to its middle;
/// false where there is no such place.
bool begin_of(double low, double high, int side, int size, int& begin) {
  const int first = std::max(0, -step_down(side - 1 - high));
  const int last = std::min(step_down(low), step_down(size - side));
  if (first > last) return false;
  begin = std::max(first, std::min(last, step_down((low + high - side + kWindowStep) / 2)));
  return true;
}

}  // namespace

Placement::Placement(int width, int height, std::vector<int> sides, int most_windows)
    : width_(width), height_(height), sides_(std::move(sides)), most_windows_(static_cast<std::size_t>(most_windows)) {}

Box Placement::with_reach(const Box& box) {
  const double reach = window_reach(box) + kWindowInset;
  return {box.left - reach, box.top - reach, box.right + reach, box.bottom + reach};
}

int Placement::side_for(const Box& box) const {
  const double extent = std::max(box.right - box.left, box.bottom - box.top) + kWindowStep;
  for (const int side : sides_) {
    if (extent <= side) return side;
  }
  return 0;
}

bool Placement::put(const Box& box, int side, SearchWindow& window) const {
  window.side = side;
  return begin_of(box.left, box.right, side, width_, window.x) &&
         begin_of(box.top, box.bottom, side, height_, window.y);
}

bool Placement::join(std::vector<Box>& boxes, bool only_savings) const {
  double least = only_savings ? 1 : 1e18;
  std::size_t first = 0, second = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = i + 1; k < boxes.size(); ++k) {
      const int side = side_for(united(boxes[i], boxes[k]));
      if (side == 0) continue;
      const double more = pixels(side) - pixels(side_for(boxes[i])) - pixels(side_for(boxes[k]));
      if (more >= least) continue;
      least = more;
      first = i;
      second = k;
    }
  }
  if (second == 0) return false;
  boxes[first] = united(boxes[first], boxes[second]);
  boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(second));
  return true;
}

Placement::Outcome Placement::place(std::vector<Box>& boxes, double most_pixels,
                                    std::vector<SearchWindow>& windows) const {
  windows.clear();
  for (Box& box : boxes) {
    box = with_reach(box);
    if (side_for(box) == 0) return Outcome::large;
    SearchWindow window;
    if (!put(box, side_for(box), window)) return Outcome::border;
  }
  while (join(boxes, true)) {
  }
  while (boxes.size() > most_windows_) {
    if (!join(boxes, false)) return Outcome::large;
  }
  double sum = 0;
  for (const Box& box : boxes) {
    SearchWindow window;
    if (!put(box, side_for(box), window)) return Outcome::border;
    sum += pixels(window.side);
    windows.push_back(window);
  }
  return sum > most_pixels ? Outcome::large : Outcome::placed;
}

}  // namespace berth
