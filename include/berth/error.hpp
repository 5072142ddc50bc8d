#pragma once

#include <stdexcept>
#include <string>

namespace berth {

/// What went wrong while setting up (a driver, a kernel build, a file, a value), with what was tried, what came back
/// and, where there is one, the remedy. Frames in flight never throw: they end in a FrameStatus.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& what) : std::runtime_error(what) {}
};

}  // namespace berth
