#include "machine.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "cpu_backend.hpp"
#include "fake_cuda.hpp"

namespace fake_cuda {
namespace {

constexpr std::size_t kMostComplaints = 20;

void set_defaults(Machine& machine) {
  set_devices(machine, "9.0");
  machine.version = 12040;
  machine.memory_limit = ~std::size_t{0};
  machine.failures.clear();
  machine.lost = kSuccess;
  machine.lose_at_kernel = 0;
  machine.held = false;
  machine.refused.clear();
  machine.loaded.clear();
  machine.calls.clear();
  machine.complaints.clear();
}

void read_environment(Machine& machine) {
  if (const char* devices = std::getenv("FAKE_CUDA_DEVICES")) set_devices(machine, devices);
  if (const char* failure = std::getenv("FAKE_CUDA_FAIL")) {
    std::istringstream fields(failure);
    std::string function, nth, status;
    std::getline(fields, function, ':');
    std::getline(fields, nth, ':');
    std::getline(fields, status, ':');
    machine.failures.push_back({function, std::atoi(nth.c_str()), std::atoi(status.c_str()), false});
  }
}

}  // namespace

// Never destroyed: threads of a process that ends may still be in it.
Machine& Machine::get() {
  static Machine* machine = new Machine;
  return *machine;
}

Machine::Machine() : ops_(berth::cpu_backend::ops()) {
  set_defaults(*this);
  read_environment(*this);
}

std::vector<CUcontext>& Machine::contexts() {
  static thread_local std::vector<CUcontext> stack;
  return stack;
}

CUresult Machine::enter_locked(const char* function) {
  calls[function] += 1;
  if (lost != kSuccess) return lost;
  for (std::size_t i = 0; i < failures.size(); ++i) {
    if (failures[i].function != function || --failures[i].nth != 0) continue;
    const Failure failure = failures[i];
    failures.erase(failures.begin() + static_cast<std::ptrdiff_t>(i));
    if (failure.lasting) lost = failure.status;
    return failure.status;
  }
  return kSuccess;
}

CUresult Machine::enter(const char* function) {
  const std::lock_guard<std::mutex> lock(mutex);
  return enter_locked(function);
}

CUresult Machine::enter_context(const char* function) {
  const std::lock_guard<std::mutex> lock(mutex);
  const CUresult status = enter_locked(function);
  if (status != kSuccess) return status;
  if (contexts().empty()) {
    return complain(kInvalidContext, std::string(function) + ": the thread has no context");
  }
  for (const auto& [device, count] : retained) {
    if (count > 0 && context_of(device) == contexts().back()) return kSuccess;
  }
  return complain(kInvalidContext, std::string(function) + ": the context was released");
}

CUresult Machine::complain(CUresult status, const std::string& what) {
  if (complaints.size() < kMostComplaints) complaints.push_back(what);
  return status;
}

unsigned char* Machine::memory(CUdeviceptr address, std::size_t bytes, const char* what) {
  auto after = device_memory.upper_bound(address);
  if (after != device_memory.begin()) {
    const auto& [base, allocation] = *--after;
    if (address + bytes <= base + allocation.second) return allocation.first.get() + (address - base);
  }
  complain(kInvalidValue, std::string(what) + ": " + std::to_string(bytes) + " bytes are not device memory");
  return nullptr;
}

bool Machine::pinned(const void* address, std::size_t bytes) const {
  auto* at = static_cast<unsigned char*>(const_cast<void*>(address));
  auto after = host_memory.upper_bound(at);
  if (after == host_memory.begin()) return false;
  const auto& [base, allocation] = *--after;
  return at + bytes <= base + allocation.second;
}

void Machine::enqueue(const std::shared_ptr<Queue>& queue, Work work) {
  queue->work.push_back(std::move(work));
  queue->taken += 1;
  changed.notify_all();
}

void Machine::wait_until_idle(std::unique_lock<std::mutex>& lock) {
  changed.wait(lock, [this] {
    return std::all_of(streams.begin(), streams.end(),
                       [](const auto& stream) { return stream.second->done == stream.second->taken; });
  });
}

void Machine::serve(const std::shared_ptr<Queue>& queue) {
  std::unique_lock<std::mutex> lock(mutex);
  while (true) {
    changed.wait(lock, [&] { return queue->closing || (!queue->work.empty() && !held); });
    if (queue->work.empty()) return;
    const Work work = std::move(queue->work.front());
    queue->work.pop_front();
    if (lost == kSuccess) {  // a lost device does nothing more
      lock.unlock();
      work();
      lock.lock();
    }
    queue->done += 1;
    changed.notify_all();
  }
}

void Machine::run(const Kernel& kernel) {
  std::vector<void*> buffers;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    if (lost != kSuccess) return;
    if (lose_at_kernel > 0 && --lose_at_kernel == 0) {
      lost = kLaunchFailed;
      return;
    }
    for (const CUdeviceptr buffer : kernel.buffers) {
      buffers.push_back(memory(buffer, 1, "a kernel that runs"));
      if (buffers.back() == nullptr) return;
    }
    clock_ms += kernel.groups;
  }
  ops_.ops[static_cast<std::size_t>(kernel.op)].run(kernel.params.data(), buffers.data(), 0,
                                                    static_cast<int>(kernel.groups));
}

int Machine::live() const {
  int contexts_held = 0;
  for (const auto& [device, count] : retained) contexts_held += count;
  const std::size_t objects = device_memory.size() + host_memory.size() + modules.size() + streams.size() +
                              events.size() + graphs.size() + execs.size();
  return contexts_held + static_cast<int>(objects);
}

void set_devices(Machine& machine, const std::string& capabilities) {
  machine.capabilities.clear();
  std::istringstream list(capabilities);
  for (std::string capability; std::getline(list, capability, ',');) {
    const std::size_t dot = capability.find('.');
    machine.capabilities.push_back(std::atoi(capability.c_str()) * 10 + std::atoi(capability.c_str() + dot + 1));
  }
}

// A process that leaves something behind, or did something wrong, does not end well.
struct LastWord {
  LastWord() { Machine::get(); }
  ~LastWord() {
    Machine& machine = Machine::get();
    const std::lock_guard<std::mutex> lock(machine.mutex);
    for (const std::string& complaint : machine.complaints) std::fprintf(stderr, "fake_cuda: %s\n", complaint.c_str());
    if (machine.live() != 0) std::fprintf(stderr, "fake_cuda: %d objects were not given back\n", machine.live());
    if (machine.live() == 0 && machine.complaints.empty()) return;
    std::fflush(nullptr);
    _exit(86);
  }
};
const LastWord last_word;

}  // namespace fake_cuda

#define CONTROL extern "C" __attribute__((visibility("default")))
using fake_cuda::Machine;

namespace {
using Lock = std::lock_guard<std::mutex>;
}

CONTROL void fake_cuda_reset() {
  Machine& machine = Machine::get();
  const Lock lock(machine.mutex);
  fake_cuda::set_defaults(machine);
  machine.changed.notify_all();
}
CONTROL void fake_cuda_set_devices(const char* capabilities) {
  const Lock lock(Machine::get().mutex);
  fake_cuda::set_devices(Machine::get(), capabilities);
}
CONTROL void fake_cuda_set_version(int version) {
  const Lock lock(Machine::get().mutex);
  Machine::get().version = version;
}
CONTROL void fake_cuda_set_memory(std::size_t bytes) {
  const Lock lock(Machine::get().mutex);
  Machine::get().memory_limit = bytes;
}
CONTROL void fake_cuda_fail(const char* function, int nth, int status, bool lasting) {
  const Lock lock(Machine::get().mutex);
  Machine::get().failures.push_back({function, nth, status, lasting});
}
CONTROL void fake_cuda_lose_at_kernel(int nth) {
  const Lock lock(Machine::get().mutex);
  Machine::get().lose_at_kernel = nth;
}
CONTROL void fake_cuda_hold(bool held) {
  Machine& machine = Machine::get();
  const Lock lock(machine.mutex);
  machine.held = held;
  machine.changed.notify_all();
}
CONTROL void fake_cuda_refuse(const char* kind, int status, const char* log) {
  const Lock lock(Machine::get().mutex);
  Machine::get().refused[kind] = {status, log};
}
CONTROL int fake_cuda_calls(const char* function) {
  const Lock lock(Machine::get().mutex);
  const auto found = Machine::get().calls.find(function);
  return found == Machine::get().calls.end() ? 0 : found->second;
}
CONTROL int fake_cuda_all_calls() {
  const Lock lock(Machine::get().mutex);
  int all = 0;
  for (const auto& [function, count] : Machine::get().calls) all += count;
  return all;
}
CONTROL int fake_cuda_live() {
  const Lock lock(Machine::get().mutex);
  return Machine::get().live();
}
CONTROL const char* fake_cuda_complaints() {
  static std::string text;
  const Lock lock(Machine::get().mutex);
  text.clear();
  for (const std::string& complaint : Machine::get().complaints) text += complaint + '\n';
  return text.c_str();
}
CONTROL const char* fake_cuda_loaded() {
  const Lock lock(Machine::get().mutex);
  return Machine::get().loaded.c_str();
}

#define X(result, name, parameters) static_assert(std::is_same_v<decltype(&name), result(*) parameters>, #name);
FAKE_CUDA_CONTROLS(X)
#undef X
