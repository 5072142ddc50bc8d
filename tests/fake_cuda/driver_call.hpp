#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "machine.hpp"

/// What every function of the driver begins with.
namespace fake_cuda {

using Lock = std::unique_lock<std::mutex>;

inline Machine& machine() { return Machine::get(); }

#define ENTER(function)                               \
  const CUresult entered = machine().enter(function); \
  if (entered != kSuccess) return entered;            \
  Lock lock(machine().mutex)

#define ENTER_CONTEXT(function)                               \
  const CUresult entered = machine().enter_context(function); \
  if (entered != kSuccess) return entered;                    \
  Lock lock(machine().mutex)

/// Forgets an object, also when the call itself fails: a lost device keeps nothing.
template <class T>
CUresult give_back(const char* function, std::map<void*, std::shared_ptr<T>>& all, void* handle) {
  const CUresult entered = machine().enter_context(function);
  const Lock lock(machine().mutex);
  if (all.erase(handle) == 0) return machine().complain(kInvalidHandle, std::string(function) + ": no such object");
  return entered;
}

template <class T>
std::shared_ptr<T> find(const std::map<void*, std::shared_ptr<T>>& all, void* handle, const char* function) {
  const auto found = all.find(handle);
  if (found != all.end()) return found->second;
  machine().complain(kInvalidHandle, std::string(function) + ": no such object");
  return nullptr;
}

#define DRIVER extern "C" __attribute__((visibility("default"))) CUresult

// As the backend declares them: whatever is defined in another way does not compile.
#define X(function, parameters) DRIVER function parameters;
BERTH_CUDA_FUNCTIONS(X)
#if FAKE_CUDA_GRAPHS
BERTH_CUDA_GRAPH_FUNCTIONS(X)
#endif
#undef X

}  // namespace fake_cuda
