#pragma once

namespace berth::cli {

/// In a radian; for people to read.
constexpr double kDegrees = 57.295779513082323;

}  // namespace berth::cli
