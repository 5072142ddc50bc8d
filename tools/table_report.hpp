#pragma once

#include <string>
#include <vector>

#include "table_run.hpp"

namespace berth::cli {

using MethodNames = std::vector<std::string>;

/// Camera, marker, sensor: everything the numbers depend on, one thing a line.
std::string setup_text(const table::Stage& stage, const table::Nominal& nominal, int frames, u64 seed,
                       const std::string& engine);

/// For each moved axis and method: its own error, largest and RMS, in mm or degrees, and as % of the range; before
/// them what the best estimator of one image could have.
std::string axes_table(const std::vector<TableSweep>& sweeps, const MethodNames& methods);
/// What one axis' motion leaves in all six, RMS, of the first method.
std::string crosstalk_table(const std::vector<TableSweep>& sweeps, const MethodNames& methods);
/// The rectangle's coupling: z and rz, and the errors in the plane.
std::string rectangle_table(const TableSweep& sweep, const MethodNames& methods);
/// A marker at rest: mean error and standard deviation of every axis.
std::string still_table(const TableSweep& sweep, const MethodNames& methods);
/// Sizes down, ranges across: RMS displacement in % of the range, and how many were found where not all were.
std::string ranges_table(const std::vector<TableSweep>& cells, const MethodNames& methods);

/// A line a frame and method, errors and all, with a heading.
std::string table_csv(const std::vector<TableSweep>& sweeps, const MethodNames& methods);

}  // namespace berth::cli
