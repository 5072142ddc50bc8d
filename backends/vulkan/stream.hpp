#pragma once

#include <memory>

#include "vulkan/plan.hpp"
#include "vulkan/staging.hpp"

namespace berth::vulkan {

/// An in-order stream for one thread, with a staging ring of that many bytes (it grows once a copy needs more). Throws
/// Error. From the first call that fails on it is lost, for good: arguments were checked while setting up, so what
/// fails later is the device.
std::unique_ptr<Stream> make_stream(const Gpu& gpu, std::size_t staging_bytes);

}  // namespace berth::vulkan
