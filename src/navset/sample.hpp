#pragma once

#include <memory>
#include <vector>

#include "navset/backdrop.hpp"
#include "navset/mesh.hpp"
#include "navset/render.hpp"
#include "sim/sensor.hpp"

namespace berth::navset {

constexpr int kSide_px = 256;

/// What an image is about. All but `target` are negatives.
enum class Subject : u8 { target, background, clutter, robot, satellite, piece, decoy };
const char* name_of(Subject subject);

/// What images of one part of a set may be made from: indices into gallery, liveries() and meshes.
struct Pool {
  std::vector<int> backdrops[2];  ///< rendered, photographs
  std::vector<int> liveries;
  std::vector<int> meshes;
};

/// The truth of one image. Coordinates in px, pixel centres at integers.
struct Label {
  Subject subject = Subject::background;
  /// Index into the gallery; into liveries() (-1 where nothing wears one).
  int backdrop = 0, livery = -1;
  const char* light = "";
  double focal_px = 0, axis_x = 0, axis_y = 0;  ///< the camera's focal length and principal point in this window
  // Of the target alone; zero in negatives.
  double visible = 0;  ///< share of its silhouette that is in the image and not hidden
  Sighting::Box visible_box,
      full_box;                     ///< first and last pixels of what is visible, and of the silhouette in the image
  double d_px = 0;                  ///< focal_px · kTargetDiameter_m / depth_m
  double x = 0, y = 0;              ///< image of the sphere's centre
  double depth_m = 0, range_m = 0;  ///< along the optical axis, and to the centre
};

/// A target less visible than this is no positive image.
constexpr double kLeastVisible = 0.5;

/// Makes images; safe to use from several threads.
class Studio {
 public:
  Studio(const Gallery& gallery, std::vector<Mesh> meshes) : gallery_(gallery), meshes_(std::move(meshes)) {}

  /// An image of `subject`, a function of `key` and the pool's content. Draws again what shows nothing (a black
  /// image, a target that its surroundings swallow) or is ambiguous (a target less than half visible).
  Label make(u64 key, Subject subject, const Pool& pool, View2D<u8> image) const;

  const std::vector<Mesh>& meshes() const { return meshes_; }

 private:
  class Shot;

  const Gallery& gallery_;
  std::vector<Mesh> meshes_;
  sim::SensorModel sensor_;
};

}  // namespace berth::navset
