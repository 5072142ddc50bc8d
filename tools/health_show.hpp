#pragma once

#include <ostream>

#include "berth/frame.hpp"
#include "berth/health.hpp"
#include "frame_json.hpp"

namespace berth::cli {

/// A result is stale this long after it was done, s.
constexpr double kStaleAfterS = 1;

/// What a frame's result is worth, with the engine as it is.
HealthMode mode_of(const HealthReport& engine, FrameStatus status);

/// "health      nominal: 12 known answers right; 5.1 MB of memory checked 3.4 times over", where anything was watched
/// or is wrong.
void print_health(std::ostream& people, const HealthReport& engine);
Json to_json(const HealthReport& engine);

}  // namespace berth::cli
