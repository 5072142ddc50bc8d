// Files of bundles: apriltag_ros' tag_bundles in YAML, read and written, and WPILib's field layouts in JSON (which is
// YAML), read.

#include <yaml-cpp/yaml.h>

#include <array>
#include <cmath>
#include <fstream>

#include "berth/bundle.hpp"
#include "berth/error.hpp"
#include "quaternion.hpp"
#include "target/file_field.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

// A marker's axes as the files have them, by those of Berth's marker frame (x right, y down, z into the plate).
// apriltag_ros: x right, y up, z out of the marker.
constexpr Mat3 kRosFromBerth = {1, 0, 0, 0, -1, 0, 0, 0, -1};
// WPILib: x out of the marker, y right and z up as one looks at it.
constexpr Mat3 kWpilibFromBerth = {0, 0, -1, 1, 0, 0, 0, -1, 0};

// Rounded quaternions are made whole; one further off is a mistake.
constexpr double kUnit = 0.01;
constexpr const char* kFormats =
    "give a YAML file with tag_bundles as apriltag_ros has them, or a WPILib field layout in JSON";

int marker_id(const FileField& field) {
  const double value = field.number();
  if (!(std::fabs(value) < 1e9) || value != static_cast<double>(static_cast<int>(value))) {
    field.fail("\"" + field.text() + "\" is not a marker's id", "give a whole number");
  }
  return static_cast<int>(value);
}

const MarkerFamily& marker_family(const FileField& field) {
  try {
    return family(field.text());
  } catch (const Error& error) {
    field.fail(error.what(), "name one that Berth has");
  }
}

// To the nearest multiple of 2^-51: coarser than what is lost between a quaternion and its rotation.
Quaternion on_grid(Quaternion q) {
  constexpr double kShift = 3;  // from 2 to 4 doubles are 2^-51 apart
  for (double& value : q) value = (value + kShift) - kShift;
  return q;
}

// The first quaternion on the grid, near the rotation's, that has just this rotation; false where none has.
bool quaternion_with(const Mat3& rotation, Quaternion& found) {
  const Quaternion near = on_grid(quaternion_of(rotation));
  constexpr double kStep = 1 / 2251799813685248.0;  // 2^-51
  constexpr std::array<double, 5> kSteps = {0, kStep, -kStep, 2 * kStep, -2 * kStep};
  for (const double w : kSteps) {
    for (const double x : kSteps) {
      for (const double y : kSteps) {
        for (const double z : kSteps) {
          found = {near[0] + w, near[1] + x, near[2] + y, near[3] + z};
          if (rotation_of(found) == rotation) return true;
        }
      }
    }
  }
  return false;
}

// What has been read from a quaternion on the grid is written as one that gives the same bits; anything else as the
// nearest on the grid, in the form in which it will be written the next time.
Quaternion settled_quaternion(const Mat3& rotation) {
  Quaternion found;
  if (quaternion_with(rotation, found)) return found;
  const Quaternion nearest = on_grid(quaternion_of(rotation));
  return quaternion_with(rotation_of(nearest), found) ? found : nearest;
}

Mat3 read_rotation(const FileField& field, const Quaternion& q) {
  const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(std::fabs(std::sqrt(square) - 1) < kUnit)) {
    field.fail("the quaternion's length is " + shortest_decimal(std::sqrt(square)),
               "give a unit quaternion; 1 0 0 0 (w x y z) is no rotation");
  }
  return rotation_of(q);
}

Bundle read_ros_bundle(const FileField& field, const MarkerFamily& usual, std::size_t number) {
  Bundle bundle;
  bundle.name = field.has("name") ? field.at("name", "").text() : "bundle_" + std::to_string(number);
  bundle.deviation_m = field.metres_or("deviation", 0);
  const MarkerFamily& common = field.has("family") ? marker_family(field.at("family", "")) : usual;
  for (const FileField& one : field.at("layout", "list the markers").items("list the markers")) {
    BundleMarker marker;
    marker.family = one.has("family") ? &marker_family(one.at("family", "")) : &common;
    marker.id = marker_id(one.at("id", "give the marker's id"));
    marker.size_m = one.at("size", "give the marker's side in metres").metres();
    const Quaternion q = {one.number_or("qw", 1), one.number_or("qx", 0), one.number_or("qy", 0),
                          one.number_or("qz", 0)};
    marker.pose.R = product(read_rotation(one, q), kRosFromBerth);
    marker.pose.t = {one.metres_or("x", 0), one.metres_or("y", 0), one.metres_or("z", 0)};
    bundle.markers.push_back(marker);
  }
  return bundle;
}

Bundle read_wpilib_layout(const FileField& root, const std::string& path, double size_m, const MarkerFamily& usual) {
  if (!(size_m > 0)) {
    throw Error(path +
                ": a WPILib field layout does not say how large its markers are; give their side in metres, "
                "0.1651 for those of FRC");
  }
  Bundle bundle;
  bundle.name = "field";
  for (const FileField& one : root.at("tags", "list the markers").items("list the markers")) {
    const FileField pose = one.at("pose", "give translation and rotation");
    const FileField place = pose.at("translation", "give x, y and z in metres");
    const FileField turn = pose.at("rotation", "give a quaternion").at("quaternion", "give W, X, Y and Z");
    const auto part = [&](const char* key) { return turn.at(key, "give W, X, Y and Z").number(); };
    const auto metres = [&](const char* key) { return place.at(key, "give x, y and z in metres").metres(); };
    BundleMarker marker;
    marker.family = &usual;
    marker.id = marker_id(one.at("ID", "give the marker's id"));
    marker.size_m = size_m;
    marker.pose.R = product(read_rotation(turn, {part("W"), part("X"), part("Y"), part("Z")}), kWpilibFromBerth);
    marker.pose.t = {metres("x"), metres("y"), metres("z")};
    bundle.markers.push_back(marker);
  }
  return bundle;
}

}  // namespace

std::vector<Bundle> read_bundles(const std::string& path, double size_m, const std::string& family_name) {
  const MarkerFamily& usual = family(family_name);
  const FileField root = FileField::open(path, "bundle file", kFormats);
  std::vector<Bundle> bundles;
  if (root.has("tag_bundles")) {
    for (const FileField& one : root.at("tag_bundles", "").items("list the bundles")) {
      bundles.push_back(read_ros_bundle(one, usual, bundles.size()));
    }
  } else if (root.has("tags")) {
    bundles.push_back(read_wpilib_layout(root, path, size_m, usual));
  }
  if (bundles.empty()) throw Error(path + ": no bundle in it; " + kFormats);
  for (const Bundle& bundle : bundles) {
    try {
      bundle.check();
    } catch (const Error& error) {
      throw Error(path + ": " + error.what());
    }
  }
  return bundles;
}

void write_bundle(const std::string& path, const Bundle& bundle) {
  bundle.check();
  YAML::Emitter name;  // a name may hold what YAML would read as something else
  name << YAML::DoubleQuoted << bundle.name;
  const MarkerFamily* common = bundle.markers[0].family;
  std::string text = "tag_bundles:\n  - name: " + std::string(name.c_str()) + "\n    family: " + common->name + "\n";
  if (bundle.deviation_m > 0) text += "    deviation: " + shortest_decimal(bundle.deviation_m) + "\n";
  text += "    layout:\n";
  for (const BundleMarker& marker : bundle.markers) {
    const Quaternion q = settled_quaternion(product(marker.pose.R, transposed(kRosFromBerth)));
    text += "      - {id: " + std::to_string(marker.id);
    if (marker.family != common) text += ", family: " + marker.family->name;
    const auto add = [&](const char* key, double value) {
      text += std::string(", ") + key + ": " + shortest_decimal(value);
    };
    add("size", marker.size_m);
    add("x", marker.pose.t[0]);
    add("y", marker.pose.t[1]);
    add("z", marker.pose.t[2]);
    add("qw", q[0]);
    add("qx", q[1]);
    add("qy", q[2]);
    add("qz", q[3]);
    text += "}\n";
  }
  std::ofstream to(path, std::ios::binary);
  to << text;
  to.close();
  if (!to) throw Error(path + ": cannot write the bundle file; check that the folder exists and is writable");
}

}  // namespace berth
