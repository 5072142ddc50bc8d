#pragma once

#include "berth/image.hpp"
#include "berth/source.hpp"
#include "sim/render.hpp"
#include "table/sweeps.hpp"

namespace berth::table {

/// The marker that stands on the table.
constexpr const char* kFamily = "tag36h11";
constexpr int kMarker = 7;

struct StageFrame {
  GrayImage image;
  TruthMarker truth;
};

/// The simulated camera in front of the table: a marker on its plate before a plain grey wall at 3 m, everything at
/// rest during the exposure, evenly lit from the camera.
class Stage {
 public:
  /// Throws Error on a lens that is not one-to-one.
  Stage(const CameraModel& camera, const sim::Sensor& sensor) : renderer_(camera), sensor_(sensor) {}

  const CameraModel& camera() const { return renderer_.camera(); }
  const sim::Sensor& sensor() const { return sensor_; }
  /// `seed` is the noise's.
  StageFrame look(const Stop& stop, u64 seed) const;

 private:
  sim::Renderer renderer_;
  sim::Sensor sensor_;
};

}  // namespace berth::table
