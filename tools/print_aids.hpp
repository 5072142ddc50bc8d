#pragma once

#include <string>

#include "print_page.hpp"

namespace berth::cli {

// What stands beside a marker or a target on paper. Millimetres.

constexpr double kMargin_mm = 8;
/// Below what is printed: dimension line, words and ruler.
constexpr double kFooter_mm = 30;
constexpr double kRuler_mm = 100;

/// An axis from (x, y) in the direction (dx, dy), along x or y, with its name.
void arrow(PrintPage& page, double x, double y, double dx, double dy, const char* name);

/// A measured length along x, with words below it.
void dimension(PrintPage& page, double x0, double x1, double y, const std::string& words);

/// 100 mm to check the printer by.
void ruler(PrintPage& page, double left, double top);

}  // namespace berth::cli
