#pragma once

#include <vector>

#include "navset/scene.hpp"

namespace berth::navset {

/// A pinhole: the ray of image point (x, y), pixel centres at integers, is ((x - cx) / focal, (y - cy) / focal, 1).
struct Camera {
  int width = 256, height = 256;
  double focal_px = 500;
  double cx = 127.5, cy = 127.5;
};

/// A key light that casts shadows, a soft one that does not, and light from everywhere, more of it from above.
struct Light {
  Vec3 key{0, 0, -1};  ///< unit vector towards it
  double key_strength = 1;
  Vec3 fill{0, -1, 0};
  double fill_strength = 0;
  double ambient = 0.1;
  Vec3 up{0, -1, 0};
};

/// What mirrors show: a square of grey values, looked up by direction.
struct Surroundings {
  const u8* pixels = nullptr;
  int side = 0;
  double gain = 0;
};

/// What was seen of the target, in sample counts and pixels; the boxes' ends are pixels that belong to it.
struct Sighting {
  struct Box {
    int x0 = 1 << 20, y0 = 1 << 20, x1 = -(1 << 20), y1 = -(1 << 20);
    void include(int x, int y);
    bool empty() const { return x1 < x0; }
  };
  /// Samples the target would have in an image without edge and without things before it; those it has.
  long silhouette = 0, visible = 0;
  /// Of its visible samples, and of its silhouette; both inside the image.
  Box visible_box, full_box;
  /// Mean difference the target makes to a pixel's radiance, over its visible samples.
  double contrast = 0;
};

/// Draws the scene over `radiance` double[height, width] (0 black, 1 white) with 2 × 2 samples a pixel, or one.
Sighting draw(const Scene& scene, const Camera& camera, const Light& light, const Surroundings& surroundings,
              int samples_across, std::vector<double>& radiance);

}  // namespace berth::navset
