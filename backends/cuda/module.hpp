#pragma once

#include <cstddef>
#include <vector>

#include "cuda/context.hpp"
#include "cuda/devices.hpp"

namespace berth::cuda {

/// The kernels compiled, as the build embedded them (backends/cuda/embed_images.cmake).
struct Image {
  const char* name;      // "PTX 6.3 for sm_53"
  int least_capability;  // of the devices that it may run on
  const void* data;      // a fatbin, or PTX text with its terminating zero
  std::size_t bytes;
};

/// In the order they are tried.
const std::vector<Image>& device_images();

/// The kernels on a device, from the first image that the driver takes, or the last if it is to be what every device
/// runs. Throws Error with the driver's log when it takes none. The context is current.
Handle<CUmodule> load_kernels(const Context& context, const Device& device, bool baseline_only);

}  // namespace berth::cuda
