#include "tag_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "berth/error.hpp"
#include "target/marker_pattern.hpp"

namespace berth::cli {
namespace {

constexpr double kMargin_mm = 8;
// Below the markers: dimension line, words and ruler.
constexpr double kFooter_mm = 30;
constexpr double kRuler_mm = 100;

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

void arrow(PrintPage& page, double x, double y, double dx, double dy, const char* name) {
  constexpr double kLength = 6, kHead = 1.2;
  const double tip_x = x + kLength * dx, tip_y = y + kLength * dy;
  page.line(x, y, tip_x, tip_y, 0.3);
  page.line(tip_x, tip_y, tip_x - kHead * (dx + dy), tip_y - kHead * (dy + dx), 0.3);
  page.line(tip_x, tip_y, tip_x - kHead * (dx - dy), tip_y - kHead * (dy - dx), 0.3);
  page.text(tip_x + 0.8 * dx + 0.6 * dy, tip_y + 0.9 * dx + 3.2 * dy, 3, name);
}

void dimension(PrintPage& page, double x0, double x1, double y, const std::string& words) {
  page.line(x0, y, x1, y);
  for (const double x : {x0, x1}) page.line(x, y - 1.5, x, y + 1.5);
  page.text(x0 + 1, y + 3.6, 3, words);
}

void ruler(PrintPage& page, double left, double top) {
  page.line(left, top, left + kRuler_mm, top);
  for (int mm = 0; mm <= static_cast<int>(kRuler_mm); ++mm) {
    page.line(left + mm, top, left + mm, top + (mm % 10 == 0 ? 4 : mm % 5 == 0 ? 3 : 2), mm % 10 == 0 ? 0.25 : 0.12);
  }
  page.text(left, top + 7.5, 2.6,
            "100 mm. If it is not, the printer scaled: measure the marker's side and give Berth that.");
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

}  // namespace berth::cli
