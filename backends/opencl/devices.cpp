#include "opencl/devices.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "berth/error.hpp"
#include "berth/ops.hpp"

namespace berth::opencl {
namespace {

/// What an ICD loader answers when no driver is registered (cl_khr_icd).
constexpr cl_int kPlatformNotFound = -1001;
/// Shared memory that a kernel may count on: Vulkan's minimum, which the kernels keep to.
constexpr unsigned long long kLocalBytes = 16384;

/// A string property, from a function (name, size, value, size_ret). Empty where the driver does not answer.
template <class Get>
std::string text_of(const Get& get) {
  std::size_t size = 0;
  if (get(0, nullptr, &size) != CL_SUCCESS || size == 0) return "";
  std::string text(size, '\0');
  if (get(size, &text[0], nullptr) != CL_SUCCESS) return "";
  text.resize(text.find_last_not_of(std::string(" \0", 2)) + 1);
  return text;
}

std::string platform_text(const Api& api, cl_platform_id platform, cl_platform_info what) {
  return text_of([&](std::size_t size, void* value, std::size_t* needed) {
    return api.clGetPlatformInfo(platform, what, size, value, needed);
  });
}

std::string device_text(const Api& api, cl_device_id device, cl_device_info what) {
  return text_of([&](std::size_t size, void* value, std::size_t* needed) {
    return api.clGetDeviceInfo(device, what, size, value, needed);
  });
}

template <class T>
T device_value(const Api& api, cl_device_id device, cl_device_info what) {
  T value{};
  return api.clGetDeviceInfo(device, what, sizeof value, &value, nullptr) == CL_SUCCESS ? value : T{};
}

/// "OpenCL 1.2 vendor's words" → 102; 0 when it is anything else.
int version_number(const std::string& text) {
  if (text.compare(0, 7, "OpenCL ") != 0) return 0;
  const std::size_t dot = text.find('.', 7);
  if (dot == std::string::npos) return 0;
  return std::atoi(text.c_str() + 7) * 100 + std::atoi(text.c_str() + dot + 1);
}

Abilities abilities_of(const Api& api, cl_device_id id) {
  Abilities abilities;
  abilities.available = device_value<cl_bool>(api, id, CL_DEVICE_AVAILABLE) == CL_TRUE;
  abilities.compiler = device_value<cl_bool>(api, id, CL_DEVICE_COMPILER_AVAILABLE) == CL_TRUE;
  abilities.little_endian = device_value<cl_bool>(api, id, CL_DEVICE_ENDIAN_LITTLE) == CL_TRUE;
  abilities.group_size = device_value<std::size_t>(api, id, CL_DEVICE_MAX_WORK_GROUP_SIZE);
  abilities.local_bytes = device_value<cl_ulong>(api, id, CL_DEVICE_LOCAL_MEM_SIZE);
  abilities.version = version_number(device_text(api, id, CL_DEVICE_VERSION));
  std::vector<std::size_t> widths(device_value<cl_uint>(api, id, CL_DEVICE_MAX_WORK_ITEM_DIMENSIONS));
  if (!widths.empty() && api.clGetDeviceInfo(id, CL_DEVICE_MAX_WORK_ITEM_SIZES, widths.size() * sizeof widths[0],
                                             widths.data(), nullptr) == CL_SUCCESS) {
    abilities.group_width = widths[0];
  }
  return abilities;
}

std::vector<cl_platform_id> find_platforms(const Api& api) {
  cl_uint count = 0;
  const cl_int status = api.clGetPlatformIDs(0, nullptr, &count);
  if (status == kPlatformNotFound || (status == CL_SUCCESS && count == 0)) {
    const char* vendors = std::getenv("OCL_ICD_VENDORS");
    throw Error("opencl: the loader finds no driver in " +
                (vendors != nullptr ? "OCL_ICD_VENDORS=" + std::string(vendors) : std::string("/etc/OpenCL/vendors")) +
                "; apt install pocl-opencl-icd (runs on the CPU) or your GPU's OpenCL driver");
  }
  check(status, "listing the platforms");
  std::vector<cl_platform_id> platforms(count);
  check(api.clGetPlatformIDs(count, platforms.data(), nullptr), "listing the platforms");
  return platforms;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return text;
}

}  // namespace

std::string shortcoming(const Abilities& abilities) {
  if (!abilities.available) return "it is not available";
  if (!abilities.compiler) return "its driver has no compiler";
  if (!abilities.little_endian) return "it is big-endian";
  if (abilities.version < 102) return "it is older than OpenCL 1.2";
  const std::size_t group = std::min(abilities.group_size, abilities.group_width);
  if (group < static_cast<std::size_t>(kGroupSize)) {
    return "its work-groups have at most " + std::to_string(group) + " work-items, not " + std::to_string(kGroupSize);
  }
  if (abilities.local_bytes < kLocalBytes) {
    return "its work-groups share " + std::to_string(abilities.local_bytes) + " bytes, not " +
           std::to_string(kLocalBytes);
  }
  return "";
}

std::vector<Device> find_devices(const Api& api) {
  std::vector<Device> found;
  std::string unfit;
  for (cl_platform_id platform : find_platforms(api)) {
    cl_uint count = 0;
    if (api.clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &count) != CL_SUCCESS || count == 0) continue;
    std::vector<cl_device_id> ids(count);
    if (api.clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, count, ids.data(), nullptr) != CL_SUCCESS) continue;
    for (cl_device_id id : ids) {
      Device device;
      device.id = id;
      device.name = device_text(api, id, CL_DEVICE_NAME);
      device.vendor = device_text(api, id, CL_DEVICE_VENDOR);
      device.driver_version = device_text(api, id, CL_DRIVER_VERSION);
      device.platform_name = platform_text(api, platform, CL_PLATFORM_NAME);
      device.platform_version = platform_text(api, platform, CL_PLATFORM_VERSION);
      const std::string reason = shortcoming(abilities_of(api, id));
      if (reason.empty()) {
        found.push_back(device);
      } else {
        unfit += (unfit.empty() ? "" : "; ") + device.name + ": " + reason;
      }
    }
  }
  if (found.empty()) {
    const std::string remedy = "; apt install pocl-opencl-icd, which runs on the CPU";
    throw Error(unfit.empty() ? "opencl: the drivers find no device" + remedy
                              : "opencl: no device can run the kernels (" + unfit + ")" + remedy);
  }
  return found;
}

std::size_t choose_device(const std::vector<std::string>& names, const std::string& wanted) {
  if (wanted.empty()) return 0;
  if (wanted.size() < 6 && wanted.find_first_not_of("0123456789") == std::string::npos) {
    const std::size_t index = static_cast<std::size_t>(std::atoi(wanted.c_str()));
    if (index < names.size()) return index;
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (lower(names[i]).find(lower(wanted)) != std::string::npos) return i;
  }
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i) list += (i == 0 ? "" : ", ") + std::to_string(i) + ": " + names[i];
  throw Error("opencl: no device '" + wanted + "'; give an index or a part of a name of " + list);
}

}  // namespace berth::opencl
