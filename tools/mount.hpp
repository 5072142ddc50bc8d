#pragma once

#include <array>
#include <optional>
#include <string>

#include "berth/marker.hpp"

namespace berth::cli {

/// x, y, z in metres and roll, pitch, yaw in degrees, in a vehicle's axes as REP-103 has them: x forward, y left, z up.
using Mount = std::array<double, 6>;

/// "X,Y,Z,ROLL,PITCH,YAW"; none where it is not six numbers below 10,000.
std::optional<Mount> read_mount(const std::string& text);

/// The frame of a camera (x right, y down, z ahead) in the vehicle's; at zero angles it looks forward.
Pose mounted_camera(const Mount& mount);
/// The frame of a marker (x right, y down, z into the plate) in the vehicle's; at zero angles its face looks forward.
Pose mounted_marker(const Mount& mount);

}  // namespace berth::cli
