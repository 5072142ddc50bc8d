#pragma once

#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/source.hpp"
#include "golden/lines.hpp"

namespace berth {
class Backend;
}

namespace berth::golden {

/// A picture by itself: its markers are read and their poses taken by their size.
struct Picture {
  std::string name;
  GrayImage image;
  CameraModel camera;
  double marker_size_m = 0;
};

/// The golden scenes, rendered: they have the same bits everywhere themselves.
struct Scenes {
  /// One frame of each corpus that recall is measured on.
  std::vector<Picture> pictures;
  /// The frames of tests/data/golden.toml: an approach to the board of bundles/approach.yaml.
  std::vector<SourceFrame> approach;
  CameraModel camera;
};

/// `root`: the folder of the repository. Throws Error where a file of it cannot be read.
Scenes render_scenes(const std::string& root);

/// What a backend and the host after it make of the scenes, from pixels to poses: digests of the pictures and of every
/// stage; corners, poses and covariances by both corner methods; the bundle's pose, the filter's and two stations'.
std::vector<std::string> frame_lines(const Scenes& scenes, Backend& backend, const std::string& root);

/// What models/lite.berthnet says of windows of the approach, and the navigator with it.
std::vector<std::string> network_lines(const Scenes& scenes, Backend& backend, const std::string& root);

}  // namespace berth::golden
