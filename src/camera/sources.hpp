#pragma once

#include <memory>
#include <string>
#include <vector>

#include "berth/source.hpp"

namespace berth {

/// Image files, one a frame, in the order given.
std::unique_ptr<Source> open_images(std::vector<std::string> paths);

/// The frames of a video file, by whatever OpenCV can decode; a frame's exposure time is its time in the file.
/// Throws Error when it cannot be opened.
std::unique_ptr<Source> open_video(const std::string& path);

/// A source by its name: `sim:FILE` (scenario), `dir:DIR`, `file:IMAGE`, `video:FILE`. A bare path is told by what it
/// is: a folder, a name ending in .toml, an image name, otherwise a video. Throws Error that lists what there is.
std::unique_ptr<Source> open_source(const std::string& spec);

}  // namespace berth
