#include "print_aids.hpp"

namespace berth::cli {

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

}  // namespace berth::cli
