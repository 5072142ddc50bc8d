#pragma once

#include <string>

#include "opencl/api.hpp"
#include "opencl/binary_cache.hpp"
#include "opencl/devices.hpp"

namespace berth::opencl {

/// What a compiled program depends on, as text: device, drivers, build options and the source's hash.
std::string program_identity(const Device& device, const std::string& source);

/// A program built for one device, and where it came from.
struct BuiltProgram {
  Handle<cl_program> program;
  bool from_cache = false;
};

/// Takes the program from the cache, or compiles it and keeps it there. A cached binary that the driver does not take
/// is replaced. Throws Error with the device's name and the compiler's log when the source does not build.
BuiltProgram build_program(const Api& api, cl_context context, const Device& device, const std::string& source,
                           const BinaryCache& cache);

}  // namespace berth::opencl
