#include "target_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "berth/error.hpp"
#include "print_aids.hpp"

namespace berth::cli {
namespace {

constexpr double kMm = 1000;
// White around the discs, as a share of the largest diameter: a half is what the search needs.
constexpr double kQuiet = 0.5;

struct Box {
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;

  void add(double x, double y, double reach) {
    left = std::min(left, x - reach), right = std::max(right, x + reach);
    top = std::min(top, y - reach), bottom = std::max(bottom, y + reach);
  }
};

Box box_of(const DiscTarget& target) {
  Box box;
  double largest = 0;
  for (const TargetDisc& disc : target.discs) largest = std::max(largest, disc.diameter_m * kMm);
  for (const TargetDisc& disc : target.discs) {
    box.add(disc.x_m * kMm, disc.y_m * kMm, disc.diameter_m / 2 * kMm + kQuiet * largest);
  }
  for (const TargetBar& bar : target.bars) {
    for (const auto& end : {bar.from_m, bar.to_m}) box.add(end[0] * kMm, end[1] * kMm, bar.width_m * kMm);
  }
  return box;
}

/// The two discs furthest apart along x.
std::pair<double, double> widest_mm(const DiscTarget& target) {
  const auto [least, most] = std::minmax_element(
      target.discs.begin(), target.discs.end(), [](const TargetDisc& a, const TargetDisc& b) { return a.x_m < b.x_m; });
  return {least->x_m * kMm, most->x_m * kMm};
}

}  // namespace

PrintPage draw_target(const DiscTarget& target, double width_mm, double height_mm) {
  target.check();
  const Box box = box_of(target);
  const double across = box.right - box.left, down = box.bottom - box.top;
  const double width = width_mm - 2 * kMargin_mm, height = height_mm - 2 * kMargin_mm - kFooter_mm;
  if (width < kRuler_mm || across > width || down > height) {
    throw Error(
        fmt::format("target \"{}\" takes {:.4g} x {:.4g} mm on a page with room for {:.4g} x {:.4g}; choose "
                    "larger --paper",
                    target.name, across, down, width, height));
  }
  const double x = (width_mm - across) / 2 - box.left, y = kMargin_mm + (height - down) / 2 - box.top;
  PrintPage page(width_mm, height_mm);
  for (const TargetBar& bar : target.bars) {
    page.line(x + bar.from_m[0] * kMm, y + bar.from_m[1] * kMm, x + bar.to_m[0] * kMm, y + bar.to_m[1] * kMm,
              bar.width_m * kMm);
  }
  for (const TargetDisc& disc : target.discs) {
    page.disc(x + disc.x_m * kMm, y + disc.y_m * kMm, disc.diameter_m / 2 * kMm);
    if (disc.hole_m > 0) page.disc(x + disc.x_m * kMm, y + disc.y_m * kMm, disc.hole_m / 2 * kMm, true);
  }
  for (const double side : {box.left, box.right}) {  // where to cut
    for (const double end : {box.top, box.bottom}) {
      page.line(x + side - 2, y + end, x + side + 2, y + end, 0.1);
      page.line(x + side, y + end - 2, x + side, y + end + 2, 0.1);
    }
  }
  const double below = y + box.bottom + 4;
  const auto [first, last] = widest_mm(target);
  dimension(page, x + first, x + last, below, fmt::format("{:.4g} mm from middle to middle", last - first));
  const double words = std::clamp(x + box.left, kMargin_mm, width_mm - kMargin_mm - kRuler_mm);
  page.text(words, below + 9, 3, fmt::format("target {}, {} discs; print at 100 %", target.name, target.discs.size()));
  ruler(page, words, below + 13);
  arrow(page, x + box.left + 3, y + box.top + 3, 1, 0, "x");
  arrow(page, x + box.left + 3, y + box.top + 3, 0, 1, "y");
  return page;
}

}  // namespace berth::cli
