#include "vulkan/instance.hpp"

#include <cstdlib>
#include <cstring>
#include <vector>

#include "berth/error.hpp"

namespace berth::vulkan {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

VKAPI_ATTR VkBool32 VKAPI_CALL report(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                      const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  (*static_cast<std::function<void(const std::string&)>*>(user))(data->pMessage);
  return VK_FALSE;
}

bool has_layer(const Api& api, const char* wanted) {
  uint32_t count = 0;
  if (api.vkEnumerateInstanceLayerProperties(&count, nullptr) < 0) return false;
  std::vector<VkLayerProperties> layers(count);
  if (api.vkEnumerateInstanceLayerProperties(&count, layers.data()) < 0) return false;
  for (const VkLayerProperties& layer : layers) {
    if (std::strcmp(layer.layerName, wanted) == 0) return true;
  }
  return false;
}

/// Drivers stay loaded from the first instance on: the loader would unload them with the last one, but they have
/// threads and memory that outlive it, and loading them again takes longer than a frame.
void keep_drivers(const Api& api, const VkApplicationInfo* application) {
  static const VkInstance kept = [&] {
    VkInstanceCreateInfo info = {};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = application;
    VkInstance instance = nullptr;
    return api.vkCreateInstance(&info, nullptr, &instance) == VK_SUCCESS ? instance : nullptr;
  }();
  static_cast<void>(kept);
}

/// Where the loader was told to look for drivers, or where it looks anyway.
std::string driver_places() {
  for (const char* name : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"}) {
    const char* value = std::getenv(name);
    if (value != nullptr && value[0] != '\0') return std::string(name) + "=" + value;
  }
  return "/usr/share/vulkan/icd.d and /etc/vulkan/icd.d";
}

}  // namespace

Instance::Instance() : api_(load_api()) {}

Instance::Instance(const Instruments& instruments) : Instance() {
  on_message_ = instruments.on_message;
  uint32_t version = 0;
  check(api_.vkEnumerateInstanceVersion(&version), "asking for the loader's version");
  if (version < VK_API_VERSION_1_1) throw Error("vulkan: the loader is older than Vulkan 1.1; apt install libvulkan1");

  VkApplicationInfo application = {};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.pApplicationName = "berth";
  application.apiVersion = VK_API_VERSION_1_1;
  VkInstanceCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  if (!on_message_) {
    create(info);
    return;
  }

  if (!has_layer(api_, kValidationLayer)) {
    throw Error(std::string("vulkan: no ") + kValidationLayer + "; apt install vulkan-validationlayers");
  }
  std::vector<VkValidationFeatureEnableEXT> checks = {VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
  if (instruments.gpu_assisted) {
    checks.push_back(VK_VALIDATION_FEATURE_ENABLE_GPU_ASSISTED_EXT);
    checks.push_back(VK_VALIDATION_FEATURE_ENABLE_GPU_ASSISTED_RESERVE_BINDING_SLOT_EXT);
  }
  VkValidationFeaturesEXT features = {};
  features.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
  features.enabledValidationFeatureCount = static_cast<uint32_t>(checks.size());
  features.pEnabledValidationFeatures = checks.data();
  VkDebugUtilsMessengerCreateInfoEXT messenger = {};
  messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  messenger.pNext = &features;
  messenger.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                          VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  messenger.pfnUserCallback = &report;
  messenger.pUserData = &on_message_;
  const char* layers[] = {kValidationLayer};
  const char* extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
  info.pNext = &messenger;  // for messages while the instance is made and destroyed
  info.enabledLayerCount = 1;
  info.ppEnabledLayerNames = layers;
  info.enabledExtensionCount = 1;
  info.ppEnabledExtensionNames = extensions;
  create(info);
  const auto make = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      api_.vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
  messenger.pNext = nullptr;
  check(make(instance_, &messenger, nullptr, &messenger_), "listening to the validation layer");
}

void Instance::create(const VkInstanceCreateInfo& info) {
  const VkResult result = api_.vkCreateInstance(&info, nullptr, &instance_);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) {
    throw Error("vulkan: the loader finds no driver in " + driver_places() +
                "; apt install mesa-vulkan-drivers (it also runs on the CPU) or your GPU's Vulkan driver");
  }
  check(result, "starting the drivers");
  keep_drivers(api_, info.pApplicationInfo);
  load_instance(api_, instance_);
}

Instance::~Instance() {
  if (messenger_ != VK_NULL_HANDLE) {
    reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
        api_.vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"))(instance_, messenger_, nullptr);
  }
  if (instance_ != nullptr) api_.vkDestroyInstance(instance_, nullptr);
}

}  // namespace berth::vulkan
