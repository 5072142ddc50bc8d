#pragma once

#include <string>

namespace berth::cli {

/// A file that comes with Berth, like "scenarios/approach.toml": installed beside the command, or in the source tree it
/// was built from. Throws Error; `remedy` ends its message.
std::string shared_file(const std::string& name, const std::string& remedy);

}  // namespace berth::cli
