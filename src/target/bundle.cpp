#include "berth/bundle.hpp"

#include <cmath>
#include <set>
#include <utility>

#include "berth/error.hpp"
#include "pose_algebra.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

// A rotation written with six decimals is off by this much; what is worse is a mistake.
constexpr double kRotation = 1e-5;

bool is_rotation(const Mat3& r) {
  const Mat3 square = product(r, transposed(r));
  for (std::size_t i = 0; i < 9; ++i) {
    if (!(std::fabs(square[i] - (i % 4 == 0 ? 1 : 0)) < kRotation)) return false;
  }
  return dot(column(r, 0), cross(column(r, 1), column(r, 2))) > 0;
}

}  // namespace

std::string name_of(const BundleMarker& marker) { return marker.family->name + " " + std::to_string(marker.id); }

const BundleMarker* Bundle::find(const MarkerFamily& family, int id) const {
  for (const BundleMarker& marker : markers) {
    if (marker.id == id && marker.family == &family) return &marker;
  }
  return nullptr;
}

void Bundle::check() const {
  const std::string what = "bundle \"" + name + "\": ";
  if (markers.empty()) throw Error(what + "it has no markers; give at least one");
  if (!(deviation_m >= 0) || !finite(deviation_m)) {
    throw Error(what + "its deviation is " + shortest_decimal(deviation_m) + "; give metres, 0 or above");
  }
  std::set<std::pair<const MarkerFamily*, int>> known;
  for (const BundleMarker& marker : markers) {
    if (marker.family == nullptr) {
      throw Error(what + "marker " + std::to_string(marker.id) + " has no family; give one");
    }
    const std::string which = what + name_of(marker);
    if (marker.id < 0 || marker.id >= static_cast<int>(marker.family->codes.size())) {
      throw Error(which + " does not exist; ids are 0 to " + std::to_string(marker.family->codes.size() - 1));
    }
    if (!known.emplace(marker.family, marker.id).second) throw Error(which + " is there twice; give each marker once");
    if (!(marker.size_m > 0) || !finite(marker.size_m)) {
      throw Error(which + " has size " + shortest_decimal(marker.size_m) + "; give its side in metres, above 0");
    }
    if (!finite(marker.pose.t[0]) || !finite(marker.pose.t[1]) || !finite(marker.pose.t[2])) {
      throw Error(which + " is not at a finite place; give metres");
    }
    if (!is_rotation(marker.pose.R)) throw Error(which + " has a matrix that is no rotation; give a rotation");
  }
}

}  // namespace berth
