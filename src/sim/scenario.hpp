#pragma once

#include <memory>
#include <string>

#include "berth/source.hpp"

namespace berth {

/// Opens a TOML scenario (docs/simulator.md) as a source of rendered frames with their truth. The frames' times are
/// those of a camera that runs at the scenario's rate, on the clock "simulation", from 0. Throws Error naming file,
/// line, field, value and remedy.
std::unique_ptr<Source> open_scenario(const std::string& path);

}  // namespace berth
