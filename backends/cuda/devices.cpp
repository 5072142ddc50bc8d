#include "cuda/devices.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "berth/error.hpp"

namespace berth::cuda {
namespace {

Device describe(const Api& api, int ordinal) {
  Device device;
  const std::string what = "asking about device " + std::to_string(ordinal);
  check(api, api.cuDeviceGet(&device.handle, ordinal), what);
  char name[256] = {};
  check(api, api.cuDeviceGetName(name, sizeof name - 1, device.handle), what);
  device.name = name;
  int major = 0;
  int minor = 0;
  check(api, api.cuDeviceGetAttribute(&major, kAttributeComputeCapabilityMajor, device.handle), what);
  check(api, api.cuDeviceGetAttribute(&minor, kAttributeComputeCapabilityMinor, device.handle), what);
  device.capability = major * 10 + minor;
  return device;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return text;
}

}  // namespace

std::vector<Device> find_devices(const Api& api) {
  int count = 0;
  check(api, api.cuDeviceGetCount(&count), "counting the devices");
  std::vector<Device> found;
  std::string unfit;
  for (int i = 0; i < count; ++i) {
    const Device device = describe(api, i);
    if (device.capability >= kLeastCapability) {
      found.push_back(device);
    } else {
      unfit += (unfit.empty() ? "" : "; ") + device.name + " has compute capability " +
               capability_text(device.capability) + ", not " + capability_text(kLeastCapability);
    }
  }
  if (found.empty()) {
    throw Error(unfit.empty()
                    ? "cuda: the driver finds no device; see nvidia-smi, and CUDA_VISIBLE_DEVICES if it is set"
                    : "cuda: no device can run the kernels (" + unfit + "); use another backend");
  }
  return found;
}

std::size_t choose_device(const std::vector<Device>& devices, const std::string& wanted) {
  if (wanted.empty()) return 0;
  if (wanted.size() < 6 && wanted.find_first_not_of("0123456789") == std::string::npos) {
    const std::size_t index = static_cast<std::size_t>(std::atoi(wanted.c_str()));
    if (index < devices.size()) return index;
  }
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (lower(devices[i].name).find(lower(wanted)) != std::string::npos) return i;
  }
  std::string list;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    list += (i == 0 ? "" : ", ") + std::to_string(i) + ": " + devices[i].name;
  }
  throw Error("cuda: no device '" + wanted + "'; give an index or a part of a name of " + list);
}

std::string capability_text(int capability) {
  return std::to_string(capability / 10) + "." + std::to_string(capability % 10);
}

}  // namespace berth::cuda
