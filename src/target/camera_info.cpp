// ROS camera_info YAML: the file camera_calibration writes and camera_info_manager reads.

#include <yaml-cpp/yaml.h>

#include <fstream>
#include <locale>
#include <sstream>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/error.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

constexpr int kMaxSide = 16384;
// A fisheye of 1 px a radian and a telescope of a million are both mistakes of unit or file.
constexpr double kMaxFocal_px = 1e6;
constexpr double kMaxCoefficient = 1e3;

// Reads fields of one file and says which one is wrong and what to do about it.
class InfoFile {
 public:
  InfoFile(std::string path, const YAML::Node& root) : path_(std::move(path)), root_(root) {}

  [[noreturn]] void fail(const std::string& field, const std::string& problem, const std::string& remedy) const {
    throw Error(path_ + ": " + field + ": " + problem + "; " + remedy);
  }

  int side(const std::string& field) const {
    const double value = number(field, scalar(root_[field], field));
    if (!(value >= 1 && value <= kMaxSide) || value != static_cast<double>(static_cast<int>(value))) {
      fail(field, shortest_decimal(value) + " is not an image size",
           "give a whole number of pixels from 1 to " + std::to_string(kMaxSide));
    }
    return static_cast<int>(value);
  }

  std::string text(const std::string& field) const { return scalar(root_[field], field); }

  bool has(const std::string& field) const { return static_cast<bool>(root_[field]); }

  /// The `data` list of a matrix field. `counts` names the lengths that are right.
  std::vector<double> matrix(const std::string& field, const std::vector<std::size_t>& counts,
                             const std::string& remedy) const {
    const YAML::Node node = root_[field];
    if (!node) fail(field, "missing", remedy);
    const std::string name = field + ".data";
    if (!node.IsMap() || !node["data"]) fail(name, "missing", remedy);
    const YAML::Node data = node["data"];
    if (!data.IsSequence()) fail(name, "not a list", remedy);
    bool right = false;
    for (const std::size_t count : counts) right = right || data.size() == count;
    if (!right) fail(name, "has " + std::to_string(data.size()) + " values", remedy);
    std::vector<double> values;
    for (std::size_t i = 0; i < data.size(); ++i) {
      const std::string item = name + "[" + std::to_string(i) + "]";
      values.push_back(number(item, scalar(data[i], item)));
    }
    return values;
  }

 private:
  std::string scalar(const YAML::Node& node, const std::string& field) const {
    if (!node) fail(field, "missing", "add it (see docs/coordinate-frames.md for an example file)");
    if (!node.IsScalar()) fail(field, "not a single value", "give one value");
    return node.Scalar();
  }

  double number(const std::string& field, const std::string& written) const {
    double value = 0;
    if (!parse_decimal(written, value)) {
      fail(field, "\"" + written + "\" is not a finite number", "give a decimal number such as 618.15");
    }
    return value;
  }

  std::string path_;
  YAML::Node root_;
};

YAML::Node load(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(path + ": cannot read the camera file; check the path and its permissions");
  std::ostringstream text;
  text << in.rdbuf();
  if (in.bad()) throw Error(path + ": cannot read the camera file; is it a folder?");
  YAML::Node root;
  try {
    root = YAML::Load(text.str());
  } catch (const YAML::Exception& error) {
    throw Error(path + ": not a YAML file (line " + std::to_string(error.mark.line + 1) + ": " + error.msg +
                "); give a ROS camera_info file as camera_calibration writes it");
  }
  if (!root.IsMap()) {
    throw Error(path + ": no camera_info fields in it; give a ROS camera_info file as camera_calibration writes it");
  }
  return root;
}

void read_matrix(const InfoFile& file, CameraModel& camera) {
  const std::string remedy = "give the nine values fx 0 cx 0 fy cy 0 0 1 of the calibration";
  const std::vector<double> k = file.matrix("camera_matrix", {9}, remedy);
  const double expected[9] = {k[0], 0, k[2], 0, k[4], k[5], 0, 0, 1};
  for (std::size_t i = 0; i < 9; ++i) {
    if (k[i] == expected[i]) continue;
    file.fail("camera_matrix.data[" + std::to_string(i) + "]",
              shortest_decimal(k[i]) + " where " + shortest_decimal(expected[i]) + " is expected",
              "Berth has no skew; " + remedy);
  }
  const auto focal = [&](std::size_t i, const char* name) {
    if (k[i] > 0 && k[i] <= kMaxFocal_px) return k[i];
    file.fail("camera_matrix.data[" + std::to_string(i) + "] (" + name + ")",
              shortest_decimal(k[i]) + " px is not a focal length",
              "give a value above 0 and up to 1e6, in pixels (not mm)");
  };
  // Crops may put the principal point outside the image; further than one image away it is a mistake.
  const auto centre = [&](std::size_t i, const char* name, int side) {
    if (k[i] >= -side && k[i] <= 2.0 * side) return k[i];
    file.fail("camera_matrix.data[" + std::to_string(i) + "] (" + name + ")",
              shortest_decimal(k[i]) + " px is far outside the image of " + std::to_string(side) + " px",
              "give a value from " + std::to_string(-side) + " to " + std::to_string(2 * side));
  };
  camera.fx = focal(0, "fx");
  camera.cx = centre(2, "cx", camera.width);
  camera.fy = focal(4, "fy");
  camera.cy = centre(5, "cy", camera.height);
}

void read_distortion(const InfoFile& file, CameraModel& camera) {
  const std::string model = file.text("distortion_model");
  std::vector<std::size_t> counts;
  std::string remedy;
  if (model == "plumb_bob") {
    counts = {4, 5};
    remedy = "give k1 k2 p1 p2 k3 (k3 may be left out)";
  } else if (model == "rational_polynomial") {
    counts = {8};
    remedy = "give k1 k2 p1 p2 k3 k4 k5 k6, the last three 0";
  } else {
    file.fail("distortion_model", "\"" + model + "\" is not supported",
              "calibrate with plumb_bob (k1 k2 p1 p2 k3)" +
                  std::string(model == "equidistant" || model == "fisheye" ? "; Berth has no fisheye model yet" : ""));
  }
  const std::vector<double> d = file.matrix("distortion_coefficients", counts, remedy);
  for (std::size_t i = 0; i < d.size(); ++i) {
    const std::string item = "distortion_coefficients.data[" + std::to_string(i) + "]";
    if (i >= 5 && d[i] != 0) {
      file.fail(item, shortest_decimal(d[i]) + " is a term of the rational model, which Berth does not have",
                "calibrate with plumb_bob");
    }
    if (!(d[i] >= -kMaxCoefficient && d[i] <= kMaxCoefficient)) {
      file.fail(item, shortest_decimal(d[i]) + " is not a distortion coefficient", "give a value from -1000 to 1000");
    }
    if (i < 5) camera.distortion[i] = d[i];
  }
}

void write_list(std::ostream& out, const char* field, int rows, int columns, const std::vector<double>& values) {
  out << field << ":\n  rows: " << rows << "\n  cols: " << columns << "\n  data: [";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i == 0 ? "" : ", ") << shortest_decimal(values[i]);
  out << "]\n";
}

}  // namespace

CameraModel read_camera_info(const std::string& path) {
  const InfoFile file(path, load(path));
  CameraModel camera;
  camera.width = file.side("image_width");
  camera.height = file.side("image_height");
  read_matrix(file, camera);
  read_distortion(file, camera);
  return camera;
}

void write_camera_info(const std::string& path, const CameraModel& camera, const std::string& name) {
  YAML::Emitter quoted;  // a name may hold what YAML would read as something else
  quoted << name;
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "image_width: " << camera.width << "\nimage_height: " << camera.height << "\ncamera_name: " << quoted.c_str()
      << "\n";
  const double fx = camera.fx, fy = camera.fy, cx = camera.cx, cy = camera.cy;
  write_list(out, "camera_matrix", 3, 3, {fx, 0, cx, 0, fy, cy, 0, 0, 1});
  out << "distortion_model: plumb_bob\n";
  write_list(out, "distortion_coefficients", 1, 5, {camera.distortion.begin(), camera.distortion.end()});
  write_list(out, "rectification_matrix", 3, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  write_list(out, "projection_matrix", 3, 4, {fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0});
  std::ofstream to(path, std::ios::binary);
  to << out.str();
  to.close();
  if (!to) throw Error(path + ": cannot write the camera file; check that the folder exists and is writable");
}

}  // namespace berth
