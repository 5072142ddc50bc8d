#include "opencl/program.hpp"

#include <vector>

#include "berth/error.hpp"

namespace berth::opencl {
namespace {

/// Nothing here may change what an integer means; there are no floats.
constexpr const char* kBuildOptions = "-cl-std=CL1.2";

std::string build_log(const Api& api, cl_program program, cl_device_id device) {
  std::size_t bytes = 0;
  if (api.clGetProgramBuildInfo(program, device, CL_PROGRAM_BUILD_LOG, 0, nullptr, &bytes) != CL_SUCCESS) return "";
  std::string log(bytes, '\0');
  if (api.clGetProgramBuildInfo(program, device, CL_PROGRAM_BUILD_LOG, bytes, &log[0], nullptr) != CL_SUCCESS)
    return "";
  return log.substr(0, log.find_last_not_of(std::string(" \n\0", 3)) + 1);
}

/// No program when the driver does not take the binary.
Handle<cl_program> from_binary(const Api& api, cl_context context, cl_device_id device,
                               const std::vector<unsigned char>& binary) {
  const unsigned char* bytes = binary.data();
  const std::size_t size = binary.size();
  cl_int taken = CL_SUCCESS;
  cl_int status = CL_SUCCESS;
  Handle<cl_program> program(api.clCreateProgramWithBinary(context, 1, &device, &size, &bytes, &taken, &status),
                             api.clReleaseProgram);
  if (status != CL_SUCCESS || taken != CL_SUCCESS ||
      api.clBuildProgram(program.get(), 1, &device, kBuildOptions, nullptr, nullptr) != CL_SUCCESS) {
    return {};
  }
  return program;
}

Handle<cl_program> from_source(const Api& api, cl_context context, const Device& device, const std::string& source) {
  const char* text = source.c_str();
  const std::size_t size = source.size();
  cl_int status = CL_SUCCESS;
  Handle<cl_program> program(api.clCreateProgramWithSource(context, 1, &text, &size, &status), api.clReleaseProgram);
  check(status, "making the kernels' program");
  status = api.clBuildProgram(program.get(), 1, &device.id, kBuildOptions, nullptr, nullptr);
  if (status != CL_SUCCESS) {
    throw Error("opencl: building the kernels for " + device.name + " failed (" + describe_status(status) +
                "): " + build_log(api, program.get(), device.id));
  }
  return program;
}

std::vector<unsigned char> binary_of(const Api& api, cl_program program) {
  std::size_t size = 0;
  if (api.clGetProgramInfo(program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, nullptr) != CL_SUCCESS) return {};
  std::vector<unsigned char> binary(size);
  unsigned char* bytes = binary.data();
  if (api.clGetProgramInfo(program, CL_PROGRAM_BINARIES, sizeof bytes, &bytes, nullptr) != CL_SUCCESS) return {};
  return binary;
}

}  // namespace

std::string program_identity(const Device& device, const std::string& source) {
  return "device " + device.name + "\nvendor " + device.vendor + "\ndriver " + device.driver_version + "\nplatform " +
         device.platform_name + ", " + device.platform_version + "\noptions " + kBuildOptions + "\nsource " +
         hash_hex(source) + "\n";
}

BuiltProgram build_program(const Api& api, cl_context context, const Device& device, const std::string& source,
                           const BinaryCache& cache) {
  const std::string identity = program_identity(device, source);
  const std::vector<unsigned char> binary = cache.load(identity);
  if (!binary.empty()) {
    Handle<cl_program> program = from_binary(api, context, device.id, binary);
    if (program.get() != nullptr) return {std::move(program), true};
  }
  Handle<cl_program> program = from_source(api, context, device, source);
  // Asking for the binary can take as long as building (PoCL then compiles every kernel).
  if (!cache.folder().empty()) cache.store(identity, binary_of(api, program.get()));
  return {std::move(program), false};
}

}  // namespace berth::opencl
