#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "berth/camera.hpp"

namespace berth {

/// A map of a camera file (YAML, and JSON, which is YAML) that is read field by field, every value checked. Whatever is
/// wrong is an Error "FILE: FIELD: what is wrong; what to do".
class CameraFields {
 public:
  /// The whole file. Throws Error where it cannot be read or holds no map.
  static CameraFields open(const std::string& path);

  [[noreturn]] void fail(const std::string& field, const std::string& problem, const std::string& remedy) const;

  bool has(const std::string& field) const;
  /// The map in a field.
  CameraFields table(const std::string& field, const std::string& remedy) const;
  /// The fields' names, in the file's order.
  std::vector<std::string> names() const;
  std::string text(const std::string& field) const;
  bool boolean(const std::string& field) const;
  /// One side of an image, px.
  int side(const std::string& field) const;
  /// A list of numbers. `counts` holds the lengths that are right.
  std::vector<double> list(const std::string& field, const std::vector<std::size_t>& counts,
                           const std::string& remedy) const;

  /// A number from a list as a side of an image; `field` is what to call it.
  int side(const std::string& field, double value) const;
  /// Checks what belongs to a pinhole: `fields` are the names of fx, fy, cx and cy.
  void set_pinhole(const std::array<std::string, 4>& fields, const std::array<double, 4>& values,
                   CameraModel& camera) const;
  /// Checks the coefficients and sets the lens, whose order they are in.
  void set_lens(LensModel lens, const std::string& field, const std::vector<double>& coefficients,
                CameraModel& camera) const;
  /// The nine values of the list `data` of a 3 × 3 camera matrix in `field`, checked; sets the pinhole.
  void set_matrix(const std::string& field, CameraModel& camera) const;

 private:
  CameraFields(std::string path, std::string prefix, const YAML::Node& node)
      : path_(std::move(path)), prefix_(std::move(prefix)), node_(node) {}

  std::string scalar(const YAML::Node& node, const std::string& field) const;
  double number(const std::string& field, const std::string& written) const;

  std::string path_, prefix_;
  YAML::Node node_;
};

/// The camera in a file of Kalibr's: the only one, or the one named.
CameraModel read_kalibr(const CameraFields& file, const std::string& name);
/// The camera in a calibration of PhotonVision's.
CameraModel read_photonvision(const CameraFields& file);
/// The camera in a file of ROS' camera_info.
CameraModel read_ros(const CameraFields& file);

}  // namespace berth
