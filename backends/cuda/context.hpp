#pragma once

#include <utility>

#include "cuda/driver.hpp"

namespace berth::cuda {

/// The driver and one device's primary context, which CUDA libraries in the same process share.
class Context {
 public:
  /// Throws Error with `name` when the device cannot be opened.
  Context(const Api& api, CUdevice device, const std::string& name) : api_(api), device_(device) {
    check(api_, api_.cuDevicePrimaryCtxRetain(&context_, device_), "opening " + name);
  }
  ~Context() { api_.release_primary_context(device_); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const Api& api() const { return api_; }
  CUcontext get() const { return context_; }

 private:
  Api api_;
  CUdevice device_;
  CUcontext context_ = nullptr;
};

/// Makes the context the calling thread's while it lives, and gives the thread its own back afterwards.
class Current {
 public:
  explicit Current(const Context& context) : api_(context.api()) { status_ = api_.cuCtxPushCurrent_v2(context.get()); }
  ~Current() {
    CUcontext popped = nullptr;
    if (status_ == kSuccess) api_.cuCtxPopCurrent_v2(&popped);
  }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;
  CUresult status() const { return status_; }
  /// Throws Error where the device is lost.
  void require() const { check(api_, status_, "entering the device's context"); }

 private:
  const Api& api_;
  CUresult status_;
};

/// Owns one object of the driver; the context outlives it.
template <class T>
class Handle {
 public:
  using Release = CUresult (*)(T);
  Handle() = default;
  Handle(const Context& context, T object, Release release) : context_(&context), object_(object), release_(release) {}
  Handle(Handle&& other) noexcept
      : context_(other.context_), object_(std::exchange(other.object_, T{})), release_(other.release_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(context_, other.context_);
    std::swap(object_, other.object_);
    std::swap(release_, other.release_);
    return *this;
  }
  ~Handle() {
    if (object_ == T{}) return;
    const Current current(*context_);
    release_(object_);
  }
  T get() const { return object_; }

 private:
  const Context* context_ = nullptr;
  T object_{};
  Release release_ = nullptr;
};

}  // namespace berth::cuda
