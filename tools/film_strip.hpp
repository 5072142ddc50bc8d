#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "berth/pilot.hpp"

namespace berth::cli {

/// A few frames of a flight in a row, each with what was found in it: a circle about the target by the network, the
/// marker's outline, mode and range.
class FilmStrip {
 public:
  /// `diameter_m`: of the circle.
  FilmStrip(const CameraModel& camera, double diameter_m) : camera_(camera), diameter_m_(diameter_m) {}

  void add(View2D<const u8> image, const PilotFrame& found, const std::string& caption);
  /// Throws Error when the file cannot be written.
  void write(const std::string& path, int columns) const;

 private:
  CameraModel camera_;
  double diameter_m_;
  std::vector<cv::Mat> frames_;
};

}  // namespace berth::cli
