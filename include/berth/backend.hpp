#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "berth/constant_memory.hpp"
#include "berth/ops.hpp"
#include "berth/types.hpp"

namespace berth {

/// Device memory of a fixed size, zeroed when made. Move-only through its unique_ptr; the backend outlives it.
class Buffer {
 public:
  explicit Buffer(std::size_t bytes) : bytes_(bytes) {}
  virtual ~Buffer() = default;
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  std::size_t bytes() const { return bytes_; }
  /// The memory itself where the host can reach it without a copy (CPU backends), null otherwise.
  virtual void* host() { return nullptr; }

 private:
  std::size_t bytes_;
};

/// One launch of an operation: its parameters, its buffers in the order of args_of(op), and how many work-items.
struct Step {
  Op op;
  std::vector<std::byte> params;
  std::vector<Buffer*> buffers;
  /// Work-items; a backend rounds up to whole groups of kGroupSize.
  int items;
};

/// A checked Step. Throws Error if the number of buffers is not the operation's.
template <class P>
Step make_step(const P& params, std::initializer_list<Buffer*> buffers, int items);
Step make_step(Op op, const void* params, std::initializer_list<Buffer*> buffers, int items);

/// A list of steps recorded once by a backend and replayed every frame.
class Plan {
 public:
  virtual ~Plan() = default;
  /// Adds what the host's memory holds of it and no replay writes; where a driver keeps it, nothing.
  virtual void list_constants(std::vector<ConstantMemory>&) const {}
};

/// When something enqueued is done, and when the device worked on it.
class Event {
 public:
  virtual ~Event() = default;
  /// Blocks until everything enqueued before the event is done. Returns false when the device was lost.
  virtual bool wait() = 0;
};

/// An in-order queue of copies and plans. Nothing but Event::wait and finish waits on the host. One thread at a time;
/// streams of one backend may be used by different threads.
class Stream {
 public:
  virtual ~Stream() = default;
  /// Copies bytes to the start of the buffer; `data` stays untouched and alive until the stream passed it.
  virtual void upload(Buffer& buffer, const void* data, std::size_t bytes) = 0;
  /// Copies the first bytes of the buffer to `data`.
  virtual void download(Buffer& buffer, void* data, std::size_t bytes) = 0;
  virtual void replay(Plan& plan) = 0;
  virtual std::unique_ptr<Event> record_event() = 0;
  /// Has all that was enqueued begin without anybody waiting for it. Only streams that hold copies back need it.
  virtual void flush() {}
  /// Whether everything is done when the call that enqueues it returns: there is no device beside the host then. Where
  /// there is one, the host may still reach its buffers (Buffer::host).
  virtual bool is_immediate() const { return false; }
  /// Waits for everything enqueued. Returns false when the device was lost.
  virtual bool finish() = 0;
  /// Runs the plan once more with each step alone on the device, and waits: what each took, ns, in the order recorded.
  /// Empty where the device cannot tell or was lost. For looking closely, not for every frame.
  virtual std::vector<std::int64_t> time_steps(Plan&) { return {}; }
};

struct DeviceInfo {
  std::string name;
  std::string driver;
};

/// A device that runs Berth's operations. It knows how to allocate, copy and launch, and no operation by name.
class Backend {
 public:
  virtual ~Backend() = default;
  virtual const char* name() const = 0;
  virtual DeviceInfo device() const = 0;
  /// These three throw Error where the device has no memory left or is lost, and with a kernel that it cannot compile.
  virtual std::unique_ptr<Buffer> make_buffer(std::size_t bytes) = 0;
  virtual std::unique_ptr<Stream> make_stream() = 0;
  /// Prepares the steps for replay; their buffers must be this backend's and outlive the plan.
  virtual std::unique_ptr<Plan> record(const std::vector<Step>& steps) = 0;
};

/// What open_backend is asked for.
struct BackendOptions {
  /// Device by index or by a part of its name; empty for the first.
  std::string device;
  /// Threads of the CPU backends; 0 for every core.
  int threads = 1;
  /// Where compiled kernels are kept; empty for $XDG_CACHE_HOME/berth or ~/.cache/berth.
  std::string cache_dir;
  /// Keeps to what every device must have, for tests: nothing that a better one offers is used. The bits are the same.
  bool baseline_only = false;
};

/// A backend this build knows, and what it found on this machine.
struct BackendStatus {
  std::string name;
  std::vector<DeviceInfo> devices;
  /// Why there is no device, and the remedy; empty when there is one.
  std::string absent;
};

/// Names in order of preference for "the default": the first that opens.
const std::vector<std::string>& backend_names();
/// Looks for every backend's devices without opening any.
std::vector<BackendStatus> probe_backends();
/// Opens a backend by name. Throws Error with the reason and the remedy when it cannot.
std::unique_ptr<Backend> open_backend(const std::string& name, const BackendOptions& options = {});

template <class P>
Step make_step(const P& params, std::initializer_list<Buffer*> buffers, int items) {
  static_assert(sizeof(P) + sizeof(int) <= 128, "Vulkan promises 128 bytes of push constants; the groups follow");
  return make_step(OpOf<P>::value, &params, buffers, items);
}

}  // namespace berth
