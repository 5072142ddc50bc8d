#pragma once

#include <vector>

#include "berth/image.hpp"
#include "sim/random.hpp"
#include "sim/sensor.hpp"

namespace berth::navset {

/// What lens and sensor do to a window.
struct Exposure {
  double gain = 1;  ///< grey levels of an exposed image, in whites, to radiance
  double gamma = 1;
  double black_level = 0;  ///< grey levels
  double blur_sigma_px = 0;
  double defocus_px = 0;                  ///< radius
  double smear_x_px = 0, smear_y_px = 0;  ///< motion during the exposure
  double full_well_e = 10000;             ///< electrons at white: shot noise
  double read_noise = 1;                  ///< grey levels
};
/// What automatic exposure goes by: half the brightness that a tenth of the pixels reach and half that which one in a
/// hundred does, together.
double metered(const std::vector<double>& radiance);
/// A camera's automatic exposure, metered on the brighter parts of the radiance: from `dimmest` to 1.25 of a good one.
Exposure random_exposure(const std::vector<double>& radiance, double dimmest, sim::Random& random);

/// A square window of a backdrop as radiance double[256, 256]: cut, turned (by any angle where nothing has an up),
/// mirrored, brightened or darkened.
std::vector<double> cut_backdrop(View2D<const u8> backdrop, bool any_way_up, sim::Random& random);

/// Radiance double[height, width], used up, as 8-bit grey.
void develop(std::vector<double>& radiance, const Exposure& exposure, const sim::SensorModel& sensor, u64 noise_seed,
             View2D<u8> image);

/// Whether next to nothing is lit: fewer than 1 % of the pixels reach 20 grey levels.
bool black(View2D<const u8> image);

}  // namespace berth::navset
