#pragma once

#include <string>
#include <vector>

#include "table_report.hpp"

namespace berth::cli {

/// Like the paper's Figure 12: for each moved axis, what was measured over what is true, and below it the error.
std::string axes_svg(const std::vector<TableSweep>& sweeps, const MethodNames& methods);

/// Like its Figure 14: the rectangle as measured, and z and rz along it less the truth.
std::string rectangle_svg(const TableSweep& sweep, const MethodNames& methods);

/// Like its Figure 11: the rectangle as the first method sees it, in three views, the marker's corner 1 dotted.
std::string rectangle_trajectory_svg(const TableSweep& sweep);

}  // namespace berth::cli
