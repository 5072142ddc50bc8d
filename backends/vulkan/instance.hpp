#pragma once

#include <functional>
#include <memory>
#include <string>

#include "vulkan/api.hpp"

namespace berth::vulkan {

/// What a developer or a test asks for beyond BackendOptions.
struct Instruments {
  /// Switches the Khronos validation layer on (core and synchronization checks) and gets every message of it: warnings
  /// and errors, from any thread. The layer must be installed: apt install vulkan-validationlayers.
  std::function<void(const std::string& message)> on_message;
  /// GPU-assisted checks too; needs on_message.
  bool gpu_assisted = false;
  /// May replace functions of the open device: to count calls, or to make them fail.
  std::function<void(Api& api)> adapt;
};

/// A Vulkan instance, with the functions of it in api(). Throws Error with the reason and the remedy.
class Instance {
 public:
  explicit Instance(const Instruments& instruments);
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  VkInstance get() const { return instance_; }
  const Api& api() const { return api_; }

 private:
  Instance();
  void create(const VkInstanceCreateInfo& info);

  Api api_;
  std::function<void(const std::string&)> on_message_;
  VkInstance instance_ = nullptr;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
};

}  // namespace berth::vulkan
