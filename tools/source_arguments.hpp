#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/source.hpp"
#include "console.hpp"
#include "interrupt.hpp"

namespace berth::cli {

/// Frames from what a command line gives: image files and folders of them, in order, or else a --source. Throws Error
/// where it gives both, or neither.
std::unique_ptr<Source> open_arguments(const std::vector<std::string>& images, const std::string& source);

/// The next frame that can be read; complains of those that cannot. None at the end, or when interrupted.
std::optional<SourceFrame> next_readable(Source& source, Console& console, const InterruptWatch& interrupt);

}  // namespace berth::cli
