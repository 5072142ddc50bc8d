// Copies and launches share one CUDA stream: a frame's upload, launches and downloads follow from each other, and what
// overlaps is other frames, on streams of their own. Nothing here throws once a stream is made.
#include "cuda/stream.hpp"

#include <cassert>
#include <cstring>
#include <mutex>

#include "berth/error.hpp"
#include "cuda/staging.hpp"

namespace berth::cuda {
namespace {

constexpr std::size_t kEventsKept = 16;

/// A CUDA stream, its copies under way and its spare events: what a Stream shares with its Events, which other threads
/// may wait for, and which may outlive it.
class Queue {
 public:
  Queue(const Context& context, std::size_t staging_bytes) : context_(context), staging_(context) {
    const Api& api = context.api();
    const Current current(context);
    current.require();
    CUstream stream = nullptr;
    // Not ordered with the default stream, which belongs to whoever else is in the process.
    check(api, api.cuStreamCreate(&stream, kStreamNonBlocking), "making a stream");
    stream_ = {context, stream, api.cuStreamDestroy_v2};
    check(api, staging_.reserve(staging_bytes),
          "pinned memory of " + std::to_string(staging_bytes) + " bytes for a stream's copies");
    spare_events_.reserve(kEventsKept);
  }

  // What is under way uses the pinned memory until then, also on a stream that is lost.
  ~Queue() {
    const Current current(context_);
    context_.api().cuStreamSynchronize(stream_.get());
  }
  Queue(const Queue&) = delete;
  Queue& operator=(const Queue&) = delete;

  void upload(const CudaBuffer& buffer, const void* data, std::size_t bytes) {
    enqueue([&](const Api& api) {
      unsigned char* memory = staging_.add(bytes, nullptr);
      if (memory == nullptr) return kOutOfMemory;
      std::memcpy(memory, data, bytes);
      return api.cuMemcpyHtoDAsync_v2(buffer.memory(), memory, bytes, stream_.get());
    });
  }

  void download(const CudaBuffer& buffer, void* data, std::size_t bytes) {
    enqueue([&](const Api& api) {
      unsigned char* memory = staging_.add(bytes, data);
      if (memory == nullptr) return kOutOfMemory;
      return api.cuMemcpyDtoHAsync_v2(memory, buffer.memory(), bytes, stream_.get());
    });
  }

  void replay(const CudaPlan& plan) {
    enqueue([&](const Api& api) {
      if (plan.graph.get() != nullptr) return api.cuGraphLaunch(plan.graph.get(), stream_.get());
      for (const Launch& launch : plan.launches) {
        const CUresult status = start(launch);
        if (status != kSuccess) return status;
      }
      return kSuccess;
    });
  }

  std::vector<std::int64_t> time_steps(const CudaPlan& plan) {
    std::vector<std::int64_t> times;
    enqueue([&](const Api& api) {
      Handle<CUevent> marks[2];
      for (Handle<CUevent>& mark : marks) {
        CUevent event = nullptr;
        const CUresult status = api.cuEventCreate(&event, kEventTiming);
        if (status != kSuccess) return status;
        mark = {context_, event, api.cuEventDestroy_v2};
      }
      for (const Launch& launch : plan.launches) {
        float ms = 0;
        CUresult status = api.cuEventRecord(marks[0].get(), stream_.get());
        if (status == kSuccess) status = start(launch);
        if (status == kSuccess) status = api.cuEventRecord(marks[1].get(), stream_.get());
        if (status == kSuccess) status = api.cuEventSynchronize(marks[1].get());
        if (status == kSuccess) status = api.elapsed(&ms, marks[0].get(), marks[1].get());
        if (status != kSuccess) return status;
        times.push_back(static_cast<std::int64_t>(static_cast<double>(ms) * 1e6));
      }
      return kSuccess;
    });
    if (is_lost()) times.clear();
    return times;
  }

  /// An event, and how many copies come before it. No event when the stream is lost.
  std::pair<Handle<CUevent>, std::uint64_t> record() {
    Handle<CUevent> recorded;
    std::uint64_t copies = 0;
    enqueue([&](const Api& api) {
      copies = staging_.added();
      if (!spare_events_.empty()) {
        recorded = std::move(spare_events_.back());
        spare_events_.pop_back();
      } else {
        CUevent event = nullptr;
        const CUresult status = api.cuEventCreate(&event, kEventDisableTiming);
        if (status != kSuccess) return status;
        recorded = {context_, event, api.cuEventDestroy_v2};
      }
      return api.cuEventRecord(recorded.get(), stream_.get());
    });
    return {std::move(recorded), copies};
  }

  void keep(Handle<CUevent> event) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (event.get() != nullptr && spare_events_.size() < kEventsKept) spare_events_.push_back(std::move(event));
  }

  bool wait(CUevent event, std::uint64_t copies) {
    if (is_lost()) return false;
    // Not under the lock: others may enqueue meanwhile.
    const CUresult status = [&] {
      const Current current(context_);
      return current.status() != kSuccess ? current.status() : context_.api().cuEventSynchronize(event);
    }();
    return settle(status, copies);
  }

  bool finish() {
    std::uint64_t copies = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (lost_) return false;
      copies = staging_.added();
    }
    const CUresult status = [&] {
      const Current current(context_);
      return current.status() != kSuccess ? current.status() : context_.api().cuStreamSynchronize(stream_.get());
    }();
    return settle(status, copies);
  }

 private:
  /// Runs the action on a stream that is not lost; whatever fails loses it.
  template <class Action>
  void enqueue(const Action& action) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (lost_) return;
    const Current current(context_);
    lost_ = current.status() != kSuccess || action(context_.api()) != kSuccess;
  }

  CUresult start(const Launch& launch) const {
    if (launch.groups == 0) return kSuccess;
    return context_.api().cuLaunchKernel(launch.function, launch.groups, 1, 1, kGroupSize, 1, 1, 0, stream_.get(),
                                         const_cast<void**>(launch.arguments.data()), nullptr);
  }

  bool is_lost() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return lost_;
  }

  bool settle(CUresult status, std::uint64_t copies) {
    const std::lock_guard<std::mutex> lock(mutex_);
    lost_ = lost_ || status != kSuccess;
    if (!lost_) staging_.complete(copies);
    return !lost_;
  }

  const Context& context_;
  std::mutex mutex_;
  bool lost_ = false;
  Staging staging_;
  std::vector<Handle<CUevent>> spare_events_;
  Handle<CUstream> stream_;
};

class CudaEvent final : public Event {
 public:
  CudaEvent(std::shared_ptr<Queue> queue, Handle<CUevent> event, std::uint64_t copies)
      : queue_(std::move(queue)), event_(std::move(event)), copies_(copies) {}
  ~CudaEvent() override { queue_->keep(std::move(event_)); }
  bool wait() override { return queue_->wait(event_.get(), copies_); }

 private:
  std::shared_ptr<Queue> queue_;
  Handle<CUevent> event_;
  std::uint64_t copies_;
};

class CudaStream final : public Stream {
 public:
  explicit CudaStream(std::shared_ptr<Queue> queue) : queue_(std::move(queue)) {}
  ~CudaStream() override { queue_->finish(); }

  void upload(Buffer& buffer, const void* data, std::size_t bytes) override {
    assert(bytes <= buffer.bytes());
    if (bytes != 0) queue_->upload(static_cast<CudaBuffer&>(buffer), data, bytes);
  }
  void download(Buffer& buffer, void* data, std::size_t bytes) override {
    assert(bytes <= buffer.bytes());
    if (bytes != 0) queue_->download(static_cast<CudaBuffer&>(buffer), data, bytes);
  }
  void replay(Plan& plan) override { queue_->replay(static_cast<CudaPlan&>(plan)); }
  std::unique_ptr<Event> record_event() override {
    auto [event, copies] = queue_->record();
    return std::make_unique<CudaEvent>(queue_, std::move(event), copies);
  }
  bool finish() override { return queue_->finish(); }
  std::vector<std::int64_t> time_steps(Plan& plan) override {
    return queue_->time_steps(static_cast<const CudaPlan&>(plan));
  }

 private:
  std::shared_ptr<Queue> queue_;
};

}  // namespace

std::unique_ptr<Stream> make_stream(const Context& context, std::size_t staging_bytes) {
  return std::make_unique<CudaStream>(std::make_shared<Queue>(context, staging_bytes));
}

}  // namespace berth::cuda
