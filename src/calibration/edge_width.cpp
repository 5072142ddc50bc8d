#include "calibration/edge_width.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace berth {
namespace {

using Point = std::array<double, 2>;

constexpr int kMostReach_px = 12;
constexpr int kSteps = 2;  // a pixel
constexpr int kProfiles = 7;

std::optional<double> sampled(View2D<const u8> image, double x, double y) {
  if (!(x >= 0 && y >= 0 && x < image.width - 1 && y < image.height - 1)) return std::nullopt;
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const double fx = x - left, fy = y - top;
  const auto grey = [&](int dx, int dy) { return static_cast<double>(image.at(left + dx, top + dy)); };
  return (1 - fy) * ((1 - fx) * grey(0, 0) + fx * grey(1, 0)) + fy * ((1 - fx) * grey(0, 1) + fx * grey(1, 1));
}

// The mean of a few profiles across the edge's middle; none where it is short, faint or cut off.
std::optional<double> width_of(const Point& a, const Point& b, View2D<const u8> image) {
  const double dx = b[0] - a[0], dy = b[1] - a[1];
  const double length = std::sqrt(dx * dx + dy * dy);
  const int reach = std::min(kMostReach_px, static_cast<int>(0.4 * length));
  if (reach < 3) return std::nullopt;
  std::vector<double> profile(static_cast<std::size_t>(2 * reach * kSteps + 1));
  for (int p = 0; p < kProfiles; ++p) {
    const double along = 0.35 + 0.3 * p / (kProfiles - 1);
    for (std::size_t i = 0; i < profile.size(); ++i) {
      const double across = (static_cast<double>(i) / kSteps - reach) / length;
      const std::optional<double> grey =
          sampled(image, a[0] + along * dx - across * dy, a[1] + along * dy + across * dx);
      if (!grey) return std::nullopt;
      profile[i] += *grey / kProfiles;
    }
  }
  double steepest = 0;
  for (std::size_t i = kSteps; i < profile.size(); ++i) {
    steepest = std::max(steepest, std::fabs(profile[i] - profile[i - kSteps]));
  }
  const auto [low, high] = std::minmax_element(profile.begin(), profile.end());
  if (!(*high - *low > 10)) return std::nullopt;  // grey levels: less is noise
  return (*high - *low) / steepest;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double edge_width_px(const Board& board, const BoardView& view, View2D<const u8> image) {
  std::map<std::size_t, Point> seen;
  for (std::size_t i = 0; i < view.points.size(); ++i) seen[view.points[i]] = view.seen_px[i];
  std::array<std::vector<double>, 2> widths;  // motion blurs the edges of one direction only
  for (const Board::Edge& edge : board.edges()) {
    const auto from = seen.find(edge.from), to = seen.find(edge.to);
    if (from == seen.end() || to == seen.end()) continue;
    const std::optional<double> width = width_of(from->second, to->second, image);
    if (width) widths[edge.upright ? 1 : 0].push_back(*width);
  }
  return std::max(median(std::move(widths[0])), median(std::move(widths[1])));
}

}  // namespace berth
