#pragma once

#include "berth/image.hpp"
#include "berth/source.hpp"
#include "sim/render.hpp"
#include "table/corner_bound.hpp"
#include "table/sweeps.hpp"

namespace berth::table {

/// The marker that stands on the table.
constexpr const char* kFamily = "tag36h11";
constexpr int kMarker = 7;

/// Points a pixel's side in which blur is computed: errors of some hundredths of a pixel are told, which tap
/// after tap at whole pixels would make by itself.
constexpr int kFineness = 4;

struct StageFrame {
  GrayImage image;
  TruthMarker truth;
  /// What the image can tell of the corners; of a marker that is not wholly in view it means nothing.
  CornerInformation information = {};
};

/// The simulated camera in front of the table: a marker on its plate before a plain grey wall at 3 m, everything at
/// rest during the exposure, evenly lit from the camera.
class Stage {
 public:
  /// `fineness` as sim::Renderer has it. Throws Error on a lens that is not one-to-one.
  Stage(const CameraModel& camera, const sim::Sensor& sensor, int fineness = kFineness)
      : renderer_(camera, fineness), fineness_(fineness), sensor_(sensor) {}

  const CameraModel& camera() const { return renderer_.camera(); }
  const sim::Sensor& sensor() const { return sensor_; }
  int fineness() const { return fineness_; }
  /// `seed` is the noise's.
  StageFrame look(const Stop& stop, u64 seed) const;

 private:
  sim::Scene scene(const Stop& stop, u64 seed) const;

  sim::Renderer renderer_;
  int fineness_;
  sim::Sensor sensor_;
};

}  // namespace berth::table
