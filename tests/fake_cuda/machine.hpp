#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "cuda/driver.hpp"
#include "host/host_backend.hpp"

/// What the fake driver drives: host memory, a worker thread a stream, and a memory of everything done wrong.
namespace fake_cuda {

using namespace berth::cuda;

constexpr CUresult kInvalidValue = 1;
constexpr CUresult kInvalidContext = 201;
constexpr CUresult kInvalidImage = 200;
constexpr CUresult kInvalidHandle = 400;
constexpr CUresult kNotFound = 500;
constexpr CUresult kLaunchFailed = 719;

/// A kernel's name and arguments as found in a module.
struct Function {
  berth::Op op;
};

struct Module {
  std::vector<std::unique_ptr<Function>> functions;
  std::map<std::string, std::vector<std::size_t>> entries;  // bytes of each argument, from PTX
  bool knows_entries = false;
};

/// A kernel launch with its arguments copied.
struct Kernel {
  berth::Op op;
  unsigned groups;
  std::vector<CUdeviceptr> buffers;
  std::vector<std::byte> params;
};

struct Graph {
  std::vector<std::unique_ptr<Kernel>> nodes;
};

using Work = std::function<void()>;

/// Everything under the machine's mutex, but the thread.
struct Queue {
  std::deque<Work> work;
  std::uint64_t taken = 0;  // how much work was ever enqueued …
  std::uint64_t done = 0;   // … and is done
  bool closing = false;
  std::thread worker;
};

struct EventState {
  bool timed = false;
  std::int64_t when_ms = 0;
  std::shared_ptr<Queue> queue;
  std::uint64_t after = 0;
};

struct Failure {
  std::string function;
  int nth;
  CUresult status;
  bool lasting;
};

class Machine {
 public:
  static Machine& get();

  // Of the calling thread.
  static std::vector<CUcontext>& contexts();

  /// Counts the call; the status that an injected failure or a lost device gives it.
  CUresult enter(const char* function);
  /// The same, for functions that need a context: the thread must have one.
  CUresult enter_context(const char* function);
  CUresult complain(CUresult status, const std::string& what);

  // What follows is called with the mutex held, unless it says otherwise.
  template <class T>
  T* own(std::map<void*, std::shared_ptr<T>>& all, std::shared_ptr<T> object) {
    T* handle = object.get();
    all.emplace(handle, std::move(object));
    return handle;
  }
  /// The host's address of device memory, or null with a complaint.
  unsigned char* memory(CUdeviceptr address, std::size_t bytes, const char* what);
  bool pinned(const void* address, std::size_t bytes) const;
  void enqueue(const std::shared_ptr<Queue>& queue, Work work);
  void wait_until_idle(std::unique_lock<std::mutex>& lock);
  int live() const;

  /// A worker's life; takes the mutex itself.
  void serve(const std::shared_ptr<Queue>& queue);
  /// On a worker, without the mutex.
  void run(const Kernel& kernel);

  std::mutex mutex;
  std::condition_variable changed;

  std::vector<int> capabilities;
  int version = 0;
  std::size_t memory_limit = 0;
  std::vector<Failure> failures;
  CUresult lost = kSuccess;
  int lose_at_kernel = 0;
  bool held = false;
  std::map<std::string, std::pair<CUresult, std::string>> refused;
  std::string loaded;
  std::map<std::string, int> calls;
  std::int64_t clock_ms = 0;  // a work-group takes a millisecond, all else nothing: times can be tested
  std::vector<std::string> complaints;

  std::map<int, int> retained;  // by device
  std::map<CUdeviceptr, std::pair<std::unique_ptr<unsigned char[]>, std::size_t>> device_memory;
  std::size_t device_bytes = 0;
  std::map<unsigned char*, std::pair<std::unique_ptr<unsigned char[]>, std::size_t>> host_memory;
  std::map<void*, std::shared_ptr<Module>> modules;
  std::set<void*> functions;
  std::map<void*, std::shared_ptr<Queue>> streams;
  std::map<void*, std::shared_ptr<EventState>> events;
  std::map<void*, std::shared_ptr<Graph>> graphs;
  std::map<void*, std::shared_ptr<Graph>> execs;

 private:
  Machine();
  CUresult enter_locked(const char* function);

  berth::host::HostOps ops_;
};

/// The context of a device.
inline CUcontext context_of(int device) {
  return reinterpret_cast<CUcontext>(static_cast<std::uintptr_t>(device + 1) << 4);
}

/// Device addresses are no host's: using one on the host is a fault.
constexpr CUdeviceptr kDeviceBit = CUdeviceptr{1} << 62;

void set_devices(Machine& machine, const std::string& capabilities);

}  // namespace fake_cuda
