#pragma once

#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"

namespace berth {

/// What the registry (src/registry.cpp) knows of a backend.
struct BackendEntry {
  const char* name;
  /// The devices it can open, in the order that BackendOptions::device counts them. Where there is none, `absent` gets
  /// the reason and the remedy. Never throws.
  std::vector<DeviceInfo> (*devices)(std::string& absent);
  /// Opens the device that options.device names. Throws Error, naming the devices there are, when there is no such.
  std::unique_ptr<Backend> (*open)(const BackendOptions& options);
};

}  // namespace berth
