#pragma once

#include <optional>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"

namespace berth::cli {

/// Writes a PNG of the image with every detection drawn: its edges (the first, corner 1 to corner 2, in red), a dot on
/// corner 1, the corners' numbers, the id (with the family where they differ), and with a pose and a camera the
/// marker's axes (x red, y green, z blue, about half a side long). Small images are enlarged by a whole factor so that
/// the marks stay legible. Throws Error when the file cannot be written.
void write_annotated(const std::string& path, View2D<const u8> image, const std::vector<Detection>& detections,
                     const std::optional<CameraModel>& camera);

}  // namespace berth::cli
