// ROS camera_info YAML: the file camera_calibration writes and camera_info_manager reads.

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <locale>
#include <sstream>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/error.hpp"
#include "berth/systematic_covariance.hpp"
#include "target/camera_fields.hpp"
#include "target/lens_name.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

// Berth's own field: one standard deviation of fx, fy, cx, cy and of the lens' coefficients.
constexpr const char* kDeviations = "standard_deviations";

void read_distortion(const CameraFields& file, CameraModel& camera) {
  const std::string model = file.text("distortion_model");
  LensModel lens = LensModel::radial_tangential;
  std::vector<std::size_t> counts;
  std::string remedy;
  if (model == "plumb_bob") {
    counts = {4, 5};
    remedy = "give k1 k2 p1 p2 k3 (k3 may be left out)";
  } else if (model == "rational_polynomial") {
    counts = {8};
    remedy = "give k1 k2 p1 p2 k3 k4 k5 k6";
  } else if (model == "equidistant" || model == "fisheye") {  // both are in use for the same
    lens = LensModel::equidistant;
    counts = {4};
    remedy = "give k1 k2 k3 k4";
  } else {
    file.fail("distortion_model", "\"" + model + "\" is not supported",
              "calibrate with plumb_bob (k1 k2 p1 p2 k3), rational_polynomial or equidistant");
  }
  const std::vector<double> coefficients = file.table("distortion_coefficients", remedy).list("data", counts, remedy);
  file.set_lens(lens, "distortion_coefficients.data", coefficients, camera);
}

void write_list(std::ostream& out, const char* field, int rows, int columns, const std::vector<double>& values) {
  out << field << ":\n  rows: " << rows << "\n  cols: " << columns << "\n  data: [";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i == 0 ? "" : ", ") << shortest_decimal(values[i]);
  out << "]\n";
}

void write_distortion(std::ostream& out, const CameraModel& camera) {
  const LensName lens = lens_name_of(camera);
  const auto count = static_cast<std::ptrdiff_t>(lens.coefficients);
  out << "distortion_model: " << lens.model << "\n";
  write_list(out, "distortion_coefficients", 1, static_cast<int>(count),
             {camera.distortion.begin(), camera.distortion.begin() + count});
}

// `more`: what follows the file's usual fields.
void write_file(const std::string& path, const CameraModel& camera, const std::string& name, const std::string& more) {
  YAML::Emitter quoted;  // a name may hold what YAML would read as something else
  quoted << name;
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "image_width: " << camera.width << "\nimage_height: " << camera.height << "\ncamera_name: " << quoted.c_str()
      << "\n";
  const double fx = camera.fx, fy = camera.fy, cx = camera.cx, cy = camera.cy;
  write_list(out, "camera_matrix", 3, 3, {fx, 0, cx, 0, fy, cy, 0, 0, 1});
  write_distortion(out, camera);
  write_list(out, "rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  write_list(out, "projection_matrix", 3, 4, {fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0});
  out << more;
  std::ofstream to(path, std::ios::binary);
  to << out.str();
  to.close();
  if (!to) throw Error(path + ": cannot write the camera file; check that the folder exists and is writable");
}

}  // namespace

CameraModel read_ros(const CameraFields& file) {
  CameraModel camera;
  camera.width = file.side("image_width");
  camera.height = file.side("image_height");
  file.set_matrix("camera_matrix", camera);
  read_distortion(file, camera);
  return camera;
}

std::optional<CalibrationDeviation> read_calibration_deviation(const std::string& path) {
  if (path.find('#') != std::string::npos) return std::nullopt;  // one of a camchain's cameras
  const CameraFields file = CameraFields::open(path);
  if (!file.has(kDeviations)) return std::nullopt;
  const std::string remedy = "give one standard deviation of each, as berth calibrate does, or leave the field out";
  const CameraFields table = file.table(kDeviations, remedy);
  const auto list = [&](const char* field, const std::vector<std::size_t>& counts) {
    const std::vector<double> values = table.list(field, counts, remedy);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] >= 0) continue;
      table.fail(std::string(field) + "[" + std::to_string(i) + "]", shortest_decimal(values[i]) + " is below 0",
                 remedy);
    }
    return values;
  };
  const std::vector<double> pinhole = list("pinhole", {4}), lens = list("distortion", {4, 5, 8});
  CalibrationDeviation deviation;
  deviation.fx = pinhole[0];
  deviation.fy = pinhole[1];
  deviation.cx = pinhole[2];
  deviation.cy = pinhole[3];
  std::copy(lens.begin(), lens.end(), deviation.distortion.begin());
  return deviation;
}

CameraModel read_camera_info(const std::string& path) { return read_ros(CameraFields::open(path)); }

void write_camera_info(const std::string& path, const CameraModel& camera, const std::string& name) {
  write_file(path, camera, name, "");
}

void write_camera_info(const std::string& path, const CameraModel& camera, const std::string& name,
                       const CalibrationDeviation& deviation) {
  const auto& d = deviation.distortion;
  const auto list = [](const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : ", ") + shortest_decimal(value);
    return "[" + text + "]\n";
  };
  write_file(path, camera, name,
             std::string(kDeviations) + ":  # fx fy cx cy, px; the distortion's coefficients\n  pinhole: " +
                 list({deviation.fx, deviation.fy, deviation.cx, deviation.cy}) + "  distortion: " +
                 list({d.begin(), d.begin() + static_cast<std::ptrdiff_t>(lens_name_of(camera).coefficients)}));
}

}  // namespace berth
