#pragma once

#include <array>
#include <optional>

#include "berth/camera.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"
#include "target/edge_profile.hpp"
#include "target/lens_blocks.hpp"
#include "target/pattern_cells.hpp"
#include "target/quad_map.hpp"

namespace berth {

/// Fits a decoded marker's whole pattern to its pixels: eight corner coordinates, levels of dark and light, tone curve
/// and blur, by Gauss-Newton steps (docs/corners.md). Per pixel integers alone; their sums do not depend on order.
class PhotometricFit {
 public:
  /// For images of one size; without a camera the marker's edges are taken as straight in the image. Takes all memory.
  PhotometricFit(const std::optional<CameraModel>& camera, int width, int height) : lens_(camera, width, height) {}

  /// `corners`: paper's order, px, within about a quarter of a module. On success they become the fit's,
  /// `covariance_px2` says how well they are known, and `fit` what the marker looks like. Returns false and changes
  /// nothing where the model does not hold: see docs/corners.md.
  bool refine(View2D<const u8> image, const MarkerFamily& family, int id, Corners& corners,
              CornerCovariance& covariance_px2, CornerFit& fit);

 private:
  LensBlocks lens_;
  EdgeProfile profile_;
  PatternCells cells_;
};

}  // namespace berth
