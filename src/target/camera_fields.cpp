#include "target/camera_fields.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "berth/error.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

constexpr int kMaxSide = 16384;
// A fisheye of 1 px a radian and a telescope of a million are both mistakes of unit or file.
constexpr double kMaxFocal_px = 1e6;
constexpr double kMaxCoefficient = 1e3;
constexpr const char* kFormats = "give a ROS camera_info, a Kalibr camchain or a PhotonVision calibration";

}  // namespace

CameraFields CameraFields::open(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(path + ": cannot read the camera file; check the path and its permissions");
  std::ostringstream text;
  text << in.rdbuf();
  if (in.bad()) throw Error(path + ": cannot read the camera file; is it a folder?");
  YAML::Node root;
  try {
    root = YAML::Load(text.str());
  } catch (const YAML::Exception& error) {
    throw Error(path + ": not a YAML file (line " + std::to_string(error.mark.line + 1) + ": " + error.msg + "); " +
                kFormats);
  }
  if (!root.IsMap()) throw Error(path + ": no camera in it; " + std::string(kFormats));
  return {path, "", root};
}

void CameraFields::fail(const std::string& field, const std::string& problem, const std::string& remedy) const {
  throw Error(path_ + ": " + prefix_ + field + ": " + problem + "; " + remedy);
}

bool CameraFields::has(const std::string& field) const { return static_cast<bool>(node_[field]); }

CameraFields CameraFields::table(const std::string& field, const std::string& remedy) const {
  const YAML::Node node = node_[field];
  if (!node) fail(field, "missing", remedy);
  if (!node.IsMap()) fail(field, "not a map", remedy);
  return {path_, prefix_ + field + ".", node};
}

std::vector<std::string> CameraFields::names() const {
  std::vector<std::string> all;
  for (const auto& entry : node_) all.push_back(entry.first.Scalar());
  return all;
}

std::string CameraFields::text(const std::string& field) const { return scalar(node_[field], field); }

bool CameraFields::boolean(const std::string& field) const {
  const std::string written = text(field);
  if (written != "true" && written != "false") fail(field, "\"" + written + "\"", "give true or false");
  return written == "true";
}

int CameraFields::side(const std::string& field) const { return side(field, number(field, text(field))); }

int CameraFields::side(const std::string& field, double value) const {
  if (!(value >= 1 && value <= kMaxSide) || value != static_cast<double>(static_cast<int>(value))) {
    fail(field, shortest_decimal(value) + " is not an image size",
         "give a whole number of pixels from 1 to " + std::to_string(kMaxSide));
  }
  return static_cast<int>(value);
}

std::vector<double> CameraFields::list(const std::string& field, const std::vector<std::size_t>& counts,
                                       const std::string& remedy) const {
  const YAML::Node values = node_[field];
  if (!values) fail(field, "missing", remedy);
  if (!values.IsSequence()) fail(field, "not a list", remedy);
  if (std::find(counts.begin(), counts.end(), values.size()) == counts.end()) {
    fail(field, "has " + std::to_string(values.size()) + " values", remedy);
  }
  std::vector<double> numbers;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string item = field + "[" + std::to_string(i) + "]";
    numbers.push_back(number(item, scalar(values[i], item)));
  }
  return numbers;
}

std::string CameraFields::scalar(const YAML::Node& node, const std::string& field) const {
  if (!node) fail(field, "missing", "add it (see docs/coordinate-frames.md for an example file)");
  if (!node.IsScalar()) fail(field, "not a single value", "give one value");
  return node.Scalar();
}

double CameraFields::number(const std::string& field, const std::string& written) const {
  double value = 0;
  if (!parse_decimal(written, value)) {
    fail(field, "\"" + written + "\" is not a finite number", "give a decimal number such as 618.15");
  }
  return value;
}

void CameraFields::set_pinhole(const std::array<std::string, 4>& fields, const std::array<double, 4>& values,
                               CameraModel& camera) const {
  const auto focal = [&](std::size_t i, const char* name) {
    if (values[i] > 0 && values[i] <= kMaxFocal_px) return values[i];
    fail(fields[i] + " (" + name + ")", shortest_decimal(values[i]) + " px is not a focal length",
         "give a value above 0 and up to 1e6, in pixels (not mm)");
  };
  // Crops may put the principal point outside the image; further than one image away it is a mistake.
  const auto centre = [&](std::size_t i, const char* name, int side) {
    if (values[i] >= -side && values[i] <= 2.0 * side) return values[i];
    fail(fields[i] + " (" + name + ")",
         shortest_decimal(values[i]) + " px is far outside the image of " + std::to_string(side) + " px",
         "give a value from " + std::to_string(-side) + " to " + std::to_string(2 * side));
  };
  camera.fx = focal(0, "fx");
  camera.fy = focal(1, "fy");
  camera.cx = centre(2, "cx", camera.width);
  camera.cy = centre(3, "cy", camera.height);
}

void CameraFields::set_lens(LensModel lens, const std::string& field, const std::vector<double>& coefficients,
                            CameraModel& camera) const {
  camera.lens = lens;
  camera.distortion = {};
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    if (!(coefficients[i] >= -kMaxCoefficient && coefficients[i] <= kMaxCoefficient)) {
      fail(field + "[" + std::to_string(i) + "]",
           shortest_decimal(coefficients[i]) + " is not a distortion coefficient", "give a value from -1000 to 1000");
    }
    camera.distortion.at(i) = coefficients[i];
  }
}

void CameraFields::set_matrix(const std::string& field, CameraModel& camera) const {
  const std::string remedy = "give the nine values fx 0 cx 0 fy cy 0 0 1 of the calibration";
  const std::vector<double> k = table(field, remedy).list("data", {9}, remedy);
  const auto name = [&](std::size_t i) { return field + ".data[" + std::to_string(i) + "]"; };
  const double expected[9] = {k[0], 0, k[2], 0, k[4], k[5], 0, 0, 1};
  for (std::size_t i = 0; i < 9; ++i) {
    if (k[i] == expected[i]) continue;
    fail(name(i), shortest_decimal(k[i]) + " where " + shortest_decimal(expected[i]) + " is expected",
         "Berth has no skew; " + remedy);
  }
  set_pinhole({name(0), name(4), name(2), name(5)}, {k[0], k[4], k[2], k[5]}, camera);
}

}  // namespace berth
