#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "berth/systematic_covariance.hpp"
#include "engine.hpp"
#include "frame_json.hpp"

namespace berth::cli {

/// --size-deviation and --edge-deviation
void add_deviation_options(CLI::App& command, EngineOptions& options);

/// What systematic errors make of the poses of a frame's detections, in their order; none where there is no pose.
using SystematicCovariances = std::vector<std::optional<std::array<double, 36>>>;

/// What calibration, the markers' size and their edges may be off by, beside the noise of a frame: from the camera's
/// file and the command line.
class SystematicErrors {
 public:
  /// Throws Error on a bad value there.
  explicit SystematicErrors(const EngineOptions& options);

  /// Whether any of them says something.
  bool known() const { return deviation_.has_value(); }
  /// What they make of a marker's pose, in an image of this size of the engine's; none without a pose.
  std::optional<std::array<double, 36>> of(const Engine& engine, int width, int height, double size_m,
                                           const Detection& marker) const;

 private:
  std::optional<CalibrationDeviation> deviation_;
};

/// Adds it to a marker's JSON, where there is one.
void add_systematic(const std::optional<std::array<double, 36>>& covariance, Json& detection);
/// ", range ± 0.12 mm, systematic ± 0.80 mm": one standard deviation along the line of sight, of the frame and of what
/// is the same in every frame.
std::string range_deviations(const Detection& marker, const std::array<double, 36>& systematic);

}  // namespace berth::cli
