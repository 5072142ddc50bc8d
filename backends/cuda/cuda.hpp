#pragma once

#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "entry.hpp"

/// NVIDIA's GPUs through the CUDA driver API. Nothing is linked: the driver is opened when it is first needed
/// (docs/cuda.md).
namespace berth::cuda {

/// The devices that can run Berth's kernels, in the driver's order. Where there is none, absent_reason says why and
/// what would help; otherwise it is empty. Never throws.
std::vector<DeviceInfo> devices(std::string& absent_reason);

/// Opens the device that options.device names. Throws Error when there is no such device, naming those there are, or
/// when the driver takes none of the kernels' images.
std::unique_ptr<Backend> open(const BackendOptions& options);

BackendEntry entry();

}  // namespace berth::cuda
