#include "host/host_backend.hpp"

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iterator>
#include <list>
#include <mutex>
#include <new>

#include "host/worker_pool.hpp"

namespace berth::host {
namespace {

/// Room that vector code may read (never write) past the end of a buffer.
constexpr std::size_t kReadSlack = 256;
constexpr std::size_t kAlignment = 64;

// Frames touch some megabytes in hundreds of places; on pages of 4 KB finding these costs a tenth of a frame whose data
// are out of the caches. Buffers share chunks that the system may put on pages of 2 MB.
constexpr std::size_t kHugePage = std::size_t{1} << 21;
#ifdef BERTH_HOST_SEPARATE_BUFFERS
constexpr std::size_t kLeastShared = 0;  // what lies behind a buffer is nobody's: a sanitizer sees who goes there
#else
constexpr std::size_t kLeastShared = kHugePage;
#endif

std::size_t rounded_up(std::size_t bytes, std::size_t unit) { return (bytes + unit - 1) / unit * unit; }

/// Memory that buffers share; it goes when the last of them does.
class Chunk {
 public:
  Chunk(std::size_t bytes, std::size_t alignment)
      : alignment_(alignment),
        bytes_(rounded_up(bytes, alignment_)),
        memory_(static_cast<unsigned char*>(::operator new(bytes_, static_cast<std::align_val_t>(alignment_)))) {
#ifdef MADV_HUGEPAGE
    if (alignment_ == kHugePage) madvise(memory_, bytes_, MADV_HUGEPAGE);  // a wish: refused, nothing is lost
#endif
  }
  ~Chunk() { ::operator delete(memory_, static_cast<std::align_val_t>(alignment_)); }
  Chunk(const Chunk&) = delete;
  Chunk& operator=(const Chunk&) = delete;

  bool has_room(std::size_t bytes) const { return bytes_ - used_ >= bytes; }
  unsigned char* take(std::size_t bytes) {
    unsigned char* const place = memory_ + used_;
    used_ += bytes;
    ++buffers_;
    return place;
  }
  /// Returns whether that was the last.
  bool give_back() { return --buffers_ == 0; }

 private:
  std::size_t alignment_;
  std::size_t bytes_;
  unsigned char* memory_;
  std::size_t used_ = 0;
  int buffers_ = 0;
};

/// A backend's chunks; buffers may be made and given back by several threads.
class HostMemory {
 public:
  explicit HostMemory(Chunks chunks) : least_chunk_(chunks == Chunks::shared ? kLeastShared : 0) {}

  struct Place {
    std::list<Chunk>::iterator chunk;
    unsigned char* memory;
  };
  Place take(std::size_t bytes) {
    const std::size_t room = rounded_up(bytes, kAlignment);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (chunks_.empty() || !chunks_.back().has_room(room)) {
      chunks_.emplace_back(std::max(room, least_chunk_), std::max(least_chunk_, kAlignment));
    }
    const auto chunk = std::prev(chunks_.end());
    return {chunk, chunk->take(room)};
  }
  void give_back(std::list<Chunk>::iterator chunk) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (chunk->give_back()) chunks_.erase(chunk);
  }

 private:
  std::size_t least_chunk_;
  std::mutex mutex_;
  std::list<Chunk> chunks_;
};

class HostBuffer final : public Buffer {
 public:
  HostBuffer(HostMemory& memory, std::size_t bytes)
      : Buffer(bytes), memory_(memory), place_(memory.take(bytes + kReadSlack)) {
    std::memset(place_.memory, 0, bytes + kReadSlack);
  }
  ~HostBuffer() override { memory_.give_back(place_.chunk); }
  void* host() override { return place_.memory; }

 private:
  HostMemory& memory_;
  HostMemory::Place place_;
};

struct Call {
  HostOp op;
  std::vector<std::byte> params;
  std::vector<void*> buffers;
  int groups;
};

class HostPlan final : public Plan {
 public:
  void list_constants(std::vector<ConstantMemory>& to) const override {
    add_constants("launch list", calls, to);
    for (const Call& call : calls) {
      add_constants("kernel parameters", call.params, to);
      // The last one is the stream's memory where an operation works in that, and written at every replay.
      const std::size_t count = call.buffers.size() - (call.op.workspace ? 1 : 0);
      if (count > 0) to.push_back({"launch list", call.buffers.data(), count * sizeof(void*)});
    }
  }

  std::vector<Call> calls;
};

class HostEvent final : public Event {
 public:
  bool wait() override { return true; }
};

class HostStream final : public Stream {
 public:
  HostStream(WorkerPool& pool, std::shared_ptr<void> workspace) : pool_(pool), workspace_(std::move(workspace)) {}
  void upload(Buffer& buffer, const void* data, std::size_t bytes) override { std::memcpy(buffer.host(), data, bytes); }
  void download(Buffer& buffer, void* data, std::size_t bytes) override { std::memcpy(data, buffer.host(), bytes); }
  void replay(Plan& plan) override {
    for (Call& call : static_cast<HostPlan&>(plan).calls) run(call);
  }
  std::unique_ptr<Event> record_event() override { return std::make_unique<HostEvent>(); }
  bool is_immediate() const override { return true; }
  bool finish() override { return true; }
  std::vector<std::int64_t> time_steps(Plan& plan) override {
    std::vector<std::int64_t> times;
    for (Call& call : static_cast<HostPlan&>(plan).calls) {
      const auto start = std::chrono::steady_clock::now();
      run(call);
      times.push_back(
          std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - start).count());
    }
    return times;
  }

 private:
  void run(Call& call) {
    if (call.op.workspace) call.buffers.back() = workspace_.get();
    if (call.op.whole || pool_.threads() == 1) {
      call.op.run(call.params.data(), call.buffers.data(), 0, call.op.whole ? 1 : call.groups);
    } else {
      pool_.share(call.groups,
                  [&call](int first, int last) { call.op.run(call.params.data(), call.buffers.data(), first, last); });
    }
  }

  WorkerPool& pool_;
  std::shared_ptr<void> workspace_;
};

class HostBackend final : public Backend {
 public:
  HostBackend(const char* name, DeviceInfo device, const HostOps& ops, int threads, Chunks chunks)
      : name_(name), device_(std::move(device)), ops_(ops), pool_(threads), memory_(chunks) {}
  const char* name() const override { return name_; }
  DeviceInfo device() const override { return device_; }
  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override {
    return std::make_unique<HostBuffer>(memory_, bytes);
  }
  std::unique_ptr<Stream> make_stream() override {
    return std::make_unique<HostStream>(pool_, ops_.make_workspace == nullptr ? nullptr : ops_.make_workspace());
  }
  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override {
    auto plan = std::make_unique<HostPlan>();
    for (const Step& step : steps) {
      Call call{
          ops_.ops[static_cast<std::size_t>(step.op)], step.params, {}, (step.items + kGroupSize - 1) / kGroupSize};
      if (call.op.parts != nullptr) {
        const int parts = call.op.parts(step.params.data());
        if (parts > 0) call.groups = parts;
        if (parts == 0) call.op.run = call.op.other;
      }
      for (Buffer* buffer : step.buffers) call.buffers.push_back(buffer->host());
      if (call.op.workspace) call.buffers.push_back(nullptr);  // the stream's
      plan->calls.push_back(std::move(call));
    }
    return plan;
  }

 private:
  const char* name_;
  DeviceInfo device_;
  HostOps ops_;
  WorkerPool pool_;
  HostMemory memory_;
};

}  // namespace

std::unique_ptr<Backend> make_host_backend(const char* name, DeviceInfo device, const HostOps& ops, int threads,
                                           Chunks chunks) {
  return std::make_unique<HostBackend>(name, std::move(device), ops, threads, chunks);
}

}  // namespace berth::host
