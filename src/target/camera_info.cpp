// ROS camera_info YAML: the file camera_calibration writes and camera_info_manager reads.

#include <yaml-cpp/yaml.h>

#include <fstream>
#include <locale>
#include <sstream>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/error.hpp"
#include "target/camera_fields.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

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
  const auto& d = camera.distortion;
  int count = 5;
  const char* model = "plumb_bob";
  if (camera.lens == LensModel::equidistant) {
    count = 4;
    model = "equidistant";
  } else if (d[5] != 0 || d[6] != 0 || d[7] != 0) {
    count = 8;
    model = "rational_polynomial";
  }
  out << "distortion_model: " << model << "\n";
  write_list(out, "distortion_coefficients", 1, count, {d.begin(), d.begin() + count});
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

CameraModel read_camera_info(const std::string& path) { return read_ros(CameraFields::open(path)); }

void write_camera_info(const std::string& path, const CameraModel& camera, const std::string& name) {
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
  std::ofstream to(path, std::ios::binary);
  to << out.str();
  to.close();
  if (!to) throw Error(path + ": cannot write the camera file; check that the folder exists and is writable");
}

}  // namespace berth
