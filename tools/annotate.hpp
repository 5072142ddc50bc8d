#pragma once

#include <optional>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/disc_target.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"

namespace berth::cli {

/// Writes a PNG of the image with every detection drawn: its edges (the first, corner 1 to corner 2, in red), a dot on
/// corner 1, the corners' numbers, the id (with the family where they differ), and with a pose and a camera the
/// marker's axes (x red, y green, z blue, about half a side long). Small images are enlarged by a whole factor so that
/// the marks stay legible. Of targets of discs that were found (`targets` and `found` go together): the outlines of
/// their discs where the pose puts them, those that were seen in green, the others in red; a dot where a disc's centre
/// was seen, the axes and the name. Throws Error when the file cannot be written.
void write_annotated(const std::string& path, View2D<const u8> image, const std::vector<Detection>& detections,
                     const std::optional<CameraModel>& camera, const std::vector<DiscTarget>& targets = {},
                     const std::vector<DiscPose>& found = {});

}  // namespace berth::cli
