#pragma once

#include <string>

#include "flight_run.hpp"

namespace berth::cli {

/// A drawing of a flight as SVG text: the range by truth, network (with its deviation) and marker over the frames, on a
/// logarithmic scale, over bands in the modes' colours with the reasons of their changes.
std::string flight_svg(const FlightLog& log);

}  // namespace berth::cli
