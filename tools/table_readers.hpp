#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apriltag_reader.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"
#include "engine.hpp"

namespace berth::cli {

/// What one method says of a frame.
struct Reading {
  Pose pose;
  /// The corners it goes by, as Detection's; none where they are not this frame's alone.
  std::optional<std::array<std::array<double, 2>, 4>> corners;
};

/// The ways from a frame of the table to a pose: corners of an engine, and a pose from them.
class TableReaders {
 public:
  /// With two stations, one more method goes by what the plate's camera sees, and one by both. Throws Error when no
  /// backend opens.
  TableReaders(const EngineOptions& options, const CameraModel& camera, int stations = 1);

  /// Berth first; AprilTag's methods only where this build has libapriltag (BERTH_WITH_APRILTAG).
  const std::vector<std::string>& names() const { return names_; }
  int stations() const { return stations_; }
  /// "simd on NAME"
  std::string engine() const { return engine_.describe(); }
  /// In the order of the names; none where the marker was not found, or has no pose. `back`: of two stations, what the
  /// plate's camera sees.
  std::vector<std::optional<Reading>> read(View2D<const u8> image, double size_m, View2D<const u8> back = {});

 private:
  std::optional<Detection> find(View2D<const u8> image, double size_m);

  CameraModel camera_;
  int stations_;
  std::vector<std::string> names_;
  Engine engine_;
  std::unique_ptr<AprilTagReader> apriltag_;
};

}  // namespace berth::cli
