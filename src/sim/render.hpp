#pragma once

#include <vector>

#include "berth/image.hpp"
#include "berth/source.hpp"
#include "sim/lens.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace berth::sim {

/// Renders scenes of one camera. Its memory is the rays of the pixel corners; render may be called from several threads
/// at once. A scene has the same bits on every machine and under every compiler: docs/simulator.md says why.
class Renderer {
 public:
  /// `fineness`: points a pixel's side in which the lens' blur is computed before pixels collect it, 1 … 8, on and
  /// about surfaces that are `fine`. With 1 the blur's taps lie at whole pixels, so that edges along rows or columns
  /// rise in straight pieces, as under no lens; where corners are measured to hundredths of a pixel, 4 is asked for.
  /// Throws Error on a camera whose lens is not one-to-one inside the image.
  explicit Renderer(const CameraModel& camera, int fineness = 1);

  const CameraModel& camera() const { return rays_.camera(); }
  /// u8[camera.height, camera.width]. Throws Error when the scene's camera is another one, or on an unknown marker.
  GrayImage render(const Scene& scene) const;

 private:
  void refine(const Scene& scene, const std::vector<Surface>& surfaces, const Surface& about,
              std::vector<double>& radiance) const;

  int fineness_;
  RayMap rays_;
  RayMap fine_rays_;
  SensorModel sensor_;
};

/// One frame, with a Renderer of its own: for a single frame. Many frames of one camera are quicker with one Renderer.
GrayImage render(const Scene& scene);

/// Every marker of the scene as it truly is at mid-exposure, in the scene's order.
std::vector<TruthMarker> truth(const Scene& scene);
/// The same of its targets of discs.
std::vector<TruthTarget> truth_targets(const Scene& scene);

}  // namespace berth::sim
