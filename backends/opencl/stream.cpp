#include "opencl/stream.hpp"

#include <cassert>

#include "berth/ops.hpp"

namespace berth::opencl {
namespace {

cl_mem memory_of(Buffer& buffer) { return static_cast<ClBuffer&>(buffer).memory(); }

class ClEvent final : public Event {
 public:
  ClEvent(const Api& api, Handle<cl_event> event, bool lost) : api_(api), event_(std::move(event)), lost_(lost) {}
  bool wait() override {
    if (lost_) return false;
    const cl_event event = event_.get();
    return api_.clWaitForEvents(1, &event) == CL_SUCCESS;
  }

 private:
  const Api& api_;
  Handle<cl_event> event_;
  bool lost_;
};

class ClStream final : public Stream {
 public:
  ClStream(const Api& api, Handle<cl_command_queue> queue) : api_(api), queue_(std::move(queue)) {}
  // The host's memory may be in use until then.
  ~ClStream() override { api_.clFinish(queue_.get()); }

  void upload(Buffer& buffer, const void* data, std::size_t bytes) override {
    assert(bytes <= buffer.bytes());
    if (bytes == 0) return;
    note(api_.clEnqueueWriteBuffer(queue_.get(), memory_of(buffer), CL_FALSE, 0, bytes, data, 0, nullptr, nullptr));
  }

  void download(Buffer& buffer, void* data, std::size_t bytes) override {
    assert(bytes <= buffer.bytes());
    if (bytes == 0) return;
    note(api_.clEnqueueReadBuffer(queue_.get(), memory_of(buffer), CL_FALSE, 0, bytes, data, 0, nullptr, nullptr));
  }

  void replay(Plan& plan) override {
    static constexpr std::size_t kGroup = kGroupSize;
    for (const Launch& launch : static_cast<ClPlan&>(plan).launches) {
      note(api_.clEnqueueNDRangeKernel(queue_.get(), launch.kernel.get(), 1, nullptr, &launch.items, &kGroup, 0,
                                       nullptr, nullptr));
    }
    flush();  // or a driver may keep it all to itself until someone waits
  }

  std::unique_ptr<Event> record_event() override {
    Handle<cl_event> event = mark();
    return std::make_unique<ClEvent>(api_, std::move(event), lost_);
  }

  void flush() override { note(api_.clFlush(queue_.get())); }

  bool finish() override {
    // clFinish alone would not tell whether what it waited for went well.
    const Handle<cl_event> last = mark();
    if (lost_) return false;
    const cl_event event = last.get();
    note(api_.clWaitForEvents(1, &event));
    return !lost_;
  }

 private:
  Handle<cl_event> mark() {
    cl_event event = nullptr;
    note(api_.clEnqueueMarkerWithWaitList(queue_.get(), 0, nullptr, &event));
    note(api_.clFlush(queue_.get()));
    return {event, api_.clReleaseEvent};
  }

  /// Whatever fails on a running stream ends it: the arguments were checked before.
  void note(cl_int status) { lost_ = lost_ || status != CL_SUCCESS; }

  const Api& api_;
  Handle<cl_command_queue> queue_;
  bool lost_ = false;
};

}  // namespace

std::unique_ptr<Stream> make_stream(const Api& api, Handle<cl_command_queue> queue) {
  return std::make_unique<ClStream>(api, std::move(queue));
}

}  // namespace berth::opencl
