#pragma once

#include <vector>

#include "berth/image.hpp"
#include "sim/lens.hpp"
#include "sim/scene.hpp"

namespace berth::sim {

/// What lens and sensor make of a radiance image: vignetting, blur, exposure, shot noise, tone curve, read noise,
/// rounding to 8 bits with saturation.
class SensorModel {
 public:
  SensorModel();

  /// `radiance` double[height, width] as paint() returns it; used as scratch.
  GrayImage expose(const Sensor& sensor, const RayMap& rays, std::vector<double> radiance, u64 seed) const;

  /// A standard normal number from 64 random bits.
  double normal(u64 bits) const;

 private:
  // Quantiles of i / kCells.
  static constexpr int kCells = 4096;
  std::vector<double> quantiles_;
};

/// Gaussian blur with the image's rim repeated outside; sigma 0 leaves the image alone.
void gaussian_blur(std::vector<double>& image, int width, int height, double sigma_px);
/// Mean over a disc: a lens out of focus. Radius 0 leaves the image alone.
void disc_blur(std::vector<double>& image, int width, int height, double radius_px);

}  // namespace berth::sim
