#include "vulkan/api.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <vector>

#include "berth/error.hpp"

namespace berth::vulkan {
namespace {

std::string last_dl_error() {
  const char* text = dlerror();
  return text != nullptr ? text : "unknown error";
}

void* open_loader(std::string& opened) {
  std::vector<std::string> names = {"libvulkan.so.1", "libvulkan.so"};
  const char* chosen = std::getenv("BERTH_VULKAN_LIBRARY");
  if (chosen != nullptr && chosen[0] != '\0') names = {chosen};
  std::string reason;
  for (const std::string& name : names) {
    // NODELETE: drivers keep threads and thread-local state, which must not lose its code.
    if (void* library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) {
      opened = name;
      return library;
    }
    if (reason.empty()) reason = last_dl_error();
  }
  if (chosen != nullptr && chosen[0] != '\0') {
    throw Error("vulkan: BERTH_VULKAN_LIBRARY cannot be opened (" + reason + "); unset it or name a Vulkan loader");
  }
  throw Error("vulkan: no Vulkan loader (" + reason + "); apt install libvulkan1 and a driver, e.g. " +
              "mesa-vulkan-drivers, which also runs on the CPU");
}

template <class Function>
void require(Function function, const char* name, const char* where) {
  if (function == nullptr) {
    throw Error(std::string("vulkan: ") + where + " lacks " + name +
                " of Vulkan 1.1; update libvulkan1 and the driver");
  }
}

}  // namespace

Api load_api() {
  std::string name;
  void* library = open_loader(name);
  Api api;
  api.vkGetInstanceProcAddr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
  require(api.vkGetInstanceProcAddr, "vkGetInstanceProcAddr", name.c_str());
#define X(function)                                                                               \
  api.function = reinterpret_cast<PFN_##function>(api.vkGetInstanceProcAddr(nullptr, #function)); \
  require(api.function, #function, name.c_str());
  BERTH_VULKAN_LOADER_FUNCTIONS(X)
#undef X
  return api;
}

void load_instance(Api& api, VkInstance instance) {
#define X(function)                                                                                \
  api.function = reinterpret_cast<PFN_##function>(api.vkGetInstanceProcAddr(instance, #function)); \
  require(api.function, #function, "the loader");
  BERTH_VULKAN_INSTANCE_FUNCTIONS(X)
#undef X
}

void load_device(Api& api, VkDevice device) {
#define X(function)                                                                            \
  api.function = reinterpret_cast<PFN_##function>(api.vkGetDeviceProcAddr(device, #function)); \
  require(api.function, #function, "the driver");
  BERTH_VULKAN_DEVICE_FUNCTIONS(X)
#undef X
}

std::string describe_result(VkResult result) {
  const char* name = "";
  switch (result) {
#define X(code)       \
  case code:          \
    name = " " #code; \
    break;
    X(VK_NOT_READY)
    X(VK_TIMEOUT)
    X(VK_INCOMPLETE)
    X(VK_ERROR_OUT_OF_HOST_MEMORY)
    X(VK_ERROR_OUT_OF_DEVICE_MEMORY)
    X(VK_ERROR_INITIALIZATION_FAILED)
    X(VK_ERROR_DEVICE_LOST)
    X(VK_ERROR_MEMORY_MAP_FAILED)
    X(VK_ERROR_LAYER_NOT_PRESENT)
    X(VK_ERROR_EXTENSION_NOT_PRESENT)
    X(VK_ERROR_FEATURE_NOT_PRESENT)
    X(VK_ERROR_INCOMPATIBLE_DRIVER)
    X(VK_ERROR_TOO_MANY_OBJECTS)
    X(VK_ERROR_FRAGMENTED_POOL)
    X(VK_ERROR_OUT_OF_POOL_MEMORY)
    X(VK_ERROR_FRAGMENTATION)
    X(VK_ERROR_INVALID_SHADER_NV)
    X(VK_ERROR_UNKNOWN)
#undef X
    default:
      break;
  }
  return std::to_string(result) + name;
}

void check(VkResult result, const std::string& what) {
  if (result >= 0) return;
  const char* remedy = "update the driver or choose another device";
  if (result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY) {
    remedy = "free some memory, or use a smaller image or smaller capacities";
  } else if (result == VK_ERROR_DEVICE_LOST) {
    remedy = "the device was reset: see the system's log, then start again";
  } else if (result == VK_ERROR_TOO_MANY_OBJECTS) {
    remedy = "use fewer detectors on this device";
  }
  throw Error("vulkan: " + what + " failed (" + describe_result(result) + "); " + remedy);
}

}  // namespace berth::vulkan
