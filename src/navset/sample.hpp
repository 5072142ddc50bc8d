#pragma once

#include <memory>
#include <vector>

#include "navset/backdrop.hpp"
#include "navset/mesh.hpp"
#include "navset/render.hpp"
#include "sim/sensor.hpp"

namespace berth::navset {

constexpr int kSide_px = 256;

/// The docking camera (the paper's Table 2, halved): a window is a part of its frame, at full size or smaller.
constexpr int kFrameWidth_px = 640, kFrameHeight_px = 480;
constexpr double kFrameFocal_px = 669;

/// What an image is about. All but `target` are negatives.
enum class Subject : u8 { target, background, clutter, robot, satellite, piece, decoy };
const char* name_of(Subject subject);

/// How well a target can be seen. By default as a search from 6 m hands windows over: at 6 m d is 45 px.
struct Conditions {
  double least_px = 40;        ///< of d; sizes are even in its logarithm up to 230 px
  double far_share = 0;        ///< of targets smaller than that, down to 8 px
  double hidden_share = 0.2;   ///< of images with something before their subject
  double least_contrast = 20;  ///< grey levels a target changes its pixels by, on average
  double dimmest = 0.5;        ///< least exposure, of a good one

  /// What is hard for people too.
  static Conditions hard() { return {24, 0.01, 0.5, 12, 0.3}; }
};

/// What images of one part of a set may be made from: indices into gallery, liveries() and meshes.
struct Pool {
  Conditions conditions;
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
