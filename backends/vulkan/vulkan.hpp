#pragma once

#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "entry.hpp"

/// Devices behind Vulkan 1.1. Nothing is linked: the loader is opened when it is first needed (docs/vulkan.md).
namespace berth::vulkan {

struct Instruments;  // vulkan/instance.hpp

/// The devices that can run Berth's kernels, in the order BackendOptions::device counts them. Where there is none,
/// absent_reason says why and what would help; otherwise it is empty. Never throws.
std::vector<DeviceInfo> devices(std::string& absent_reason);

/// Opens the device that options.device names. Throws Error when there is no such device, naming those there are, or
/// when its driver rejects the kernels.
std::unique_ptr<Backend> open(const BackendOptions& options);
std::unique_ptr<Backend> open(const BackendOptions& options, const Instruments& instruments);

BackendEntry entry();

}  // namespace berth::vulkan
