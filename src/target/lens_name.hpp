#pragma once

#include <cstddef>

#include "berth/camera.hpp"

namespace berth {

/// What ROS calls a camera's lens, and how many of CameraModel::distortion it has.
struct LensName {
  const char* model;
  std::size_t coefficients;
};

inline LensName lens_name_of(const CameraModel& camera) {
  if (camera.lens == LensModel::equidistant) return {"equidistant", 4};
  const auto& d = camera.distortion;
  if (d[5] != 0 || d[6] != 0 || d[7] != 0) return {"rational_polynomial", 8};
  return {"plumb_bob", 5};
}

}  // namespace berth
