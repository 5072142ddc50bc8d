#pragma once

#include <array>

#include "berth/marker.hpp"

namespace berth {

/// A pose as recordings hold it, {"R","t"}, in metres. `Json`: nlohmann::json or ordered_json; throws their exception
/// where it is none.
template <class Json>
Pose recorded_pose(const Json& json) {
  Pose pose;
  pose.R = json.at("R").template get<std::array<double, 9>>();
  pose.t = json.at("t").template get<std::array<double, 3>>();
  return pose;
}

}  // namespace berth
