#include "systematic_show.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pose_algebra.hpp"

namespace berth::cli {
namespace {

// Of the distance, m.
double along_sight(const std::array<double, 36>& covariance, const Pose& pose) {
  const Vec3 way = normalized(pose.t);
  double variance = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) variance += way[i] * covariance[6 * i + j] * way[j];
  }
  return std::sqrt(variance);
}

}  // namespace

void add_deviation_options(CLI::App& command, EngineOptions& options) {
  command
      .add_option("--size-deviation", options.size_deviation,
                  "one standard deviation of the markers' side: poses then come with what it makes of them, together "
                  "with the deviations in the camera's file (berth calibrate writes them)")
      ->type_name("METRES");
  command
      .add_option("--edge-deviation", options.edge_deviation,
                  "likewise of how far all sides of a marker lie too far out or in, as a bent tone curve or saturation "
                  "puts them")
      ->type_name("PX")
      ->check(CLI::Range(0.0, 10.0));
}

SystematicErrors::SystematicErrors(const EngineOptions& options) {
  if (!options.camera_file.empty()) deviation_ = read_calibration_deviation(options.camera_file);
  const auto made = [&]() -> CalibrationDeviation& { return deviation_ ? *deviation_ : deviation_.emplace(); };
  if (!options.size_deviation.empty()) {
    made().marker_size_m =
        parse_metres("--size-deviation", options.size_deviation,
                     "give one standard deviation of the marker's side in metres, above 0, e.g. 0.0002");
  }
  if (options.edge_deviation > 0) made().edge_px = options.edge_deviation;
}

std::optional<std::array<double, 36>> SystematicErrors::of(const Engine& engine, int width, int height, double size_m,
                                                           const Detection& marker) const {
  const std::optional<CameraModel> camera = engine.camera_for(width, height);
  if (!deviation_ || !camera || !marker.has_pose) return std::nullopt;
  CalibrationDeviation here = *deviation_;
  // Of a resized image the calibration's pixels are others.
  const double scale = camera->fx / engine.config().camera->fx;
  for (double* value : {&here.fx, &here.fy, &here.cx, &here.cy}) *value *= scale;
  std::array<double, 36> covariance{};
  if (!systematic_covariance(*camera, size_m, marker, here, covariance)) return std::nullopt;
  return covariance;
}

void add_systematic(const std::optional<std::array<double, 36>>& covariance, Json& detection) {
  if (covariance) detection["pose"]["systematic_covariance"] = *covariance;
}

std::string range_deviations(const Detection& marker, const std::array<double, 36>& systematic) {
  std::string text = ", range";
  if (marker.pose_uncertainty) {
    text += fmt::format(" ± {:.3f} mm,", 1000 * along_sight(marker.pose_uncertainty->covariance, marker.pose));
  }
  return text + fmt::format(" systematic ± {:.3f} mm", 1000 * along_sight(systematic, marker.pose));
}

}  // namespace berth::cli
