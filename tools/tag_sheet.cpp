#include "tag_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "berth/error.hpp"
#include "pose_algebra.hpp"
#include "print_aids.hpp"
#include "target/marker_pattern.hpp"

namespace berth::cli {
namespace {

/// Dark modules as one rectangle a run, row by row.
void draw_marker(const TagSheet& sheet, int id, double left, double top, PrintPage& page) {
  const int total = sheet.family->total_width;
  const std::vector<u8> pattern = marker_pattern(*sheet.family, id);
  const double module = sheet.module_mm();
  for (int y = 0; y < total; ++y) {
    const u8* row = pattern.data() + static_cast<std::ptrdiff_t>(y) * total;
    for (int x = 0; x < total;) {
      const int from = x;
      while (x < total && row[x] == row[from]) ++x;
      if (row[from] == 0) page.rectangle(left + from * module, top + y * module, (x - from) * module, module);
    }
  }
}

}  // namespace

double TagSheet::pitch_mm() const {
  return side_mm + (gap_mm > 0 ? gap_mm : (family->total_width - family->border_width + 2) * module_mm());
}
double TagSheet::across_mm() const { return (columns - 1) * pitch_mm() + (family->total_width + 2) * module_mm(); }
double TagSheet::down_mm() const { return (rows - 1) * pitch_mm() + (family->total_width + 2) * module_mm(); }

PrintPage draw_sheet(const TagSheet& sheet) {
  const long long last = static_cast<long long>(sheet.first_id) + sheet.columns * sheet.rows - 1;
  const auto ids = static_cast<long long>(sheet.family->codes.size());
  if (sheet.first_id < 0 || last >= ids) {
    throw Error(fmt::format("{} has no marker {}; ids are 0 to {}", sheet.family->name,
                            sheet.first_id < 0 ? sheet.first_id : last, ids - 1));
  }
  const double least_gap_mm = (sheet.family->total_width + 1) * sheet.module_mm() - sheet.side_mm;
  if (sheet.gap_mm > 0 && sheet.gap_mm < least_gap_mm) {
    throw Error(fmt::format("--gap {:.6g} leaves no module of white between neighbours; give {:.5f} or more",
                            sheet.gap_mm / 1000, std::ceil(least_gap_mm * 100) / 1e5));
  }
  const double width = sheet.width_mm - 2 * kMargin_mm, height = sheet.height_mm - 2 * kMargin_mm - kFooter_mm;
  if (width < kRuler_mm || sheet.across_mm() > width || sheet.down_mm() > height) {
    throw Error(
        fmt::format("{:.4g} x {:.4g} mm of markers on a page with room for {:.4g} x {:.4g}; choose larger --paper, "
                    "a smaller --size or fewer markers",
                    sheet.across_mm(), sheet.down_mm(), width, height));
  }
  PrintPage page(sheet.width_mm, sheet.height_mm);
  const double module = sheet.module_mm();
  const double edge =
      (sheet.family->total_width - sheet.family->border_width) / 2.0 * module;  // of print beyond the side
  const double left = (sheet.width_mm - sheet.across_mm()) / 2;
  const double top = kMargin_mm + std::max(0.0, (height - sheet.down_mm()) / 2);
  for (int row = 0; row < sheet.rows; ++row) {
    for (int column = 0; column < sheet.columns; ++column) {
      draw_marker(sheet, sheet.first_id + row * sheet.columns + column, left + module + column * sheet.pitch_mm(),
                  top + module + row * sheet.pitch_mm(), page);
    }
  }
  for (const double x : {left, left + sheet.across_mm()}) {  // where to cut
    for (const double y : {top, top + sheet.down_mm()}) {
      page.line(x - 2, y, x + 2, y, 0.1);
      page.line(x, y - 2, x, y + 2, 0.1);
    }
  }
  const double below = top + sheet.down_mm() + 4;
  const double side_left = left + module + edge;
  dimension(page, side_left, side_left + sheet.side_mm, below, fmt::format("{:.4g} mm", sheet.side_mm));
  const double words = std::clamp(left, kMargin_mm, sheet.width_mm - kMargin_mm - kRuler_mm);
  const std::string numbers =
      last == sheet.first_id ? fmt::format("{}", last) : fmt::format("{} to {}", sheet.first_id, last);
  std::string title = fmt::format("{} {}, side {:.4g} mm", sheet.family->name, numbers, sheet.side_mm);
  if (last > sheet.first_id) title += fmt::format(", {:.4g} mm from one to the next", sheet.pitch_mm());
  page.text(words, below + 9, 3, title + "; print at 100 %");
  ruler(page, words, below + 13);
  // The marker's axes (docs/coordinate-frames.md), beside the first one's upper left corner; z is into the paper.
  arrow(page, left - 3, top - 3, 1, 0, "x");
  arrow(page, left - 3, top - 3, 0, 1, "y");
  return page;
}

namespace {

/// A marker of a bundle on paper: its middle, and how its x and y lie there (quarter turns).
struct Placed {
  const BundleMarker* marker;
  double x, y;
  std::array<int, 4> turn;  // row-major

  double module_mm() const { return marker->size_m * 1000 / marker->family->border_width; }
  /// Half of what is printed of it.
  double half_mm() const { return module_mm() * marker->family->total_width / 2; }
  /// A rectangle of its modules, from the upper left of its print, on the page.
  PrintPage::Rectangle modules(double left, double top, double across, double down) const {
    const double x0 = left * module_mm() - half_mm(), y0 = top * module_mm() - half_mm();
    const double x1 = x0 + across * module_mm(), y1 = y0 + down * module_mm();
    const double ax = turn[0] * x0 + turn[1] * y0, ay = turn[2] * x0 + turn[3] * y0;
    const double bx = turn[0] * x1 + turn[1] * y1, by = turn[2] * x1 + turn[3] * y1;
    return {x + std::min(ax, bx), y + std::min(ay, by), std::fabs(bx - ax), std::fabs(by - ay)};
  }
  PrintPage::Rectangle print() const { return modules(0, 0, marker->family->total_width, marker->family->total_width); }
};

constexpr double kTouch_mm = 0.01;

bool overlap(const PrintPage::Rectangle& a, const PrintPage::Rectangle& b) {
  return a.x + a.width > b.x + kTouch_mm && b.x + b.width > a.x + kTouch_mm && a.y + a.height > b.y + kTouch_mm &&
         b.y + b.height > a.y + kTouch_mm;
}

std::vector<Placed> places_on_paper(const Bundle& bundle) {
  const Pose paper = inverse(bundle.markers.at(0).pose);
  std::vector<Placed> all;
  for (const BundleMarker& marker : bundle.markers) {
    const Pose pose = compose(paper, marker.pose);
    if (std::fabs(pose.t[2]) * 1000 > kTouch_mm || pose.R[8] < 1 - 1e-6) {
      throw Error(fmt::format("bundle \"{}\": {} is not in the plane of {}, facing the same way; print it by itself",
                              bundle.name, name_of(marker), name_of(bundle.markers[0])));
    }
    Placed placed{&marker, pose.t[0] * 1000, pose.t[1] * 1000, {}};
    const std::array<double, 4> turn = {pose.R[0], pose.R[1], pose.R[3], pose.R[4]};
    for (std::size_t i = 0; i < 4; ++i) {
      placed.turn[i] = static_cast<int>(std::lround(turn[i]));
      if (std::fabs(turn[i] - placed.turn[i]) < 1e-5) continue;
      throw Error(fmt::format("bundle \"{}\": {} is not turned by quarters against {}; print it by itself", bundle.name,
                              name_of(marker), name_of(bundle.markers[0])));
    }
    all.push_back(placed);
  }
  return all;
}

/// Whether the module carries nothing, so that a smaller marker may stand there: inside of the border and no bit.
bool is_free(const MarkerFamily& family, int x, int y) {
  const int offset = (family.total_width - family.border_width) / 2, last = family.border_width - 2;
  const int column = x - offset, row = y - offset;
  if (column < 1 || row < 1 || column > last || row > last) return false;
  for (std::size_t i = 0; i < family.bit_x.size(); ++i) {
    if (family.bit_x[i] == column && family.bit_y[i] == row) return false;
  }
  return true;
}

/// The dark modules of a marker, without those where a smaller one stands.
void draw_placed(const Placed& placed, const std::vector<Placed>& all, PrintPage& page) {
  const MarkerFamily& family = *placed.marker->family;
  const std::vector<u8> pattern = marker_pattern(family, placed.marker->id);
  for (int i = 0; i < family.total_width * family.total_width; ++i) {
    const int x = i % family.total_width, y = i / family.total_width;
    const PrintPage::Rectangle module = placed.modules(x, y, 1, 1);
    const Placed* on_top = nullptr;
    for (const Placed& other : all) {
      if (other.marker != placed.marker && other.module_mm() < placed.module_mm() && overlap(module, other.print())) {
        on_top = &other;
      }
    }
    if (on_top != nullptr && !is_free(family, x, y)) {
      throw Error(fmt::format("{} stands on {}, which is not free there; move it or make it smaller",
                              name_of(*on_top->marker), name_of(*placed.marker)));
    }
    if (on_top == nullptr && pattern[static_cast<std::size_t>(i)] == 0) {
      page.rectangle(module.x, module.y, module.width, module.height);
    }
  }
}

}  // namespace

PrintPage draw_bundle(const Bundle& bundle, double width_mm, double height_mm) {
  bundle.check();
  std::vector<Placed> all = places_on_paper(bundle);
  double left = all[0].x, right = all[0].x, top = all[0].y, bottom = all[0].y;
  for (const Placed& placed : all) {
    const double reach = placed.half_mm() + placed.module_mm();
    left = std::min(left, placed.x - reach), right = std::max(right, placed.x + reach);
    top = std::min(top, placed.y - reach), bottom = std::max(bottom, placed.y + reach);
    for (const Placed& other : all) {
      if (&other == &placed || other.module_mm() != placed.module_mm() || !overlap(other.print(), placed.print())) {
        continue;
      }
      throw Error(name_of(*placed.marker) + " and " + name_of(*other.marker) + " overlap; move one of them");
    }
  }
  const double width = width_mm - 2 * kMargin_mm, height = height_mm - 2 * kMargin_mm - kFooter_mm;
  if (width < kRuler_mm || right - left > width || bottom - top > height) {
    throw Error(
        fmt::format("{:.4g} x {:.4g} mm of markers on a page with room for {:.4g} x {:.4g}; choose larger --paper",
                    right - left, bottom - top, width, height));
  }
  const double shift_x = (width_mm - (left + right)) / 2;
  const double shift_y = kMargin_mm + (height - (bottom - top)) / 2 - top;
  for (Placed& placed : all) placed.x += shift_x, placed.y += shift_y;
  PrintPage page(width_mm, height_mm);
  for (const Placed& placed : all) draw_placed(placed, all, page);
  const Placed& first = all[0];
  const double below = bottom + shift_y + 4, side_mm = first.marker->size_m * 1000;
  dimension(page, first.x - side_mm / 2, first.x + side_mm / 2, below,
            fmt::format("{:.4g} mm: {}", side_mm, name_of(*first.marker)));
  const double words = std::clamp(left + shift_x, kMargin_mm, width_mm - kMargin_mm - kRuler_mm);
  page.text(words, below + 9, 3, fmt::format("bundle, {} markers; print at 100 %", all.size()));
  ruler(page, words, below + 13);
  return page;
}

}  // namespace berth::cli
