#pragma once

#include <dlfcn.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

#include "fake_cuda/fake_cuda.hpp"

/// The fake driver's controls, and BERTH_CUDA_LIBRARY pointing at it while this lives.
struct FakeDriver {
  /// `variant` of "current", "cuda10" and "no_graphs": see fake_cuda/CMakeLists.txt.
  explicit FakeDriver(const std::string& variant) {
    const std::string path = std::string(BERTH_FAKE_CUDA_DIR) + "/" + variant + "/libcuda.so.1";
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (library == nullptr) throw std::runtime_error(dlerror());
#define X(result, name, parameters) name = reinterpret_cast<result(*) parameters>(dlsym(library, #name));
    FAKE_CUDA_CONTROLS(X)
#undef X
    setenv("BERTH_CUDA_LIBRARY", path.c_str(), 1);
    fake_cuda_reset();
  }
  ~FakeDriver() {
    fake_cuda_reset();
    unsetenv("BERTH_CUDA_LIBRARY");
  }
  FakeDriver(const FakeDriver&) = delete;
  FakeDriver& operator=(const FakeDriver&) = delete;

#define X(result, name, parameters) result(*name) parameters = nullptr;
  FAKE_CUDA_CONTROLS(X)
#undef X
};
