#pragma once

#include <memory>
#include <string>
#include <vector>

#include "berth/source.hpp"

namespace berth::cli {

/// Frames from what a command line gives: image files and folders of them, in order, or else a --source. Throws Error
/// where it gives both, or neither.
std::unique_ptr<Source> open_arguments(const std::vector<std::string>& images, const std::string& source);

}  // namespace berth::cli
