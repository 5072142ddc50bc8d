#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "berth/backend.hpp"
#include "opencl/api.hpp"

namespace berth::opencl {

class ClBuffer final : public Buffer {
 public:
  ClBuffer(std::size_t bytes, cl_context context, Handle<cl_mem> memory)
      : Buffer(bytes), context_(context), memory_(std::move(memory)) {}
  cl_context context() const { return context_; }
  cl_mem memory() const { return memory_.get(); }

 private:
  cl_context context_;
  Handle<cl_mem> memory_;
};

/// One kernel with its arguments set for good.
struct Launch {
  Handle<cl_kernel> kernel;
  std::size_t items;  // a multiple of kGroupSize
};

class ClPlan final : public Plan {
 public:
  std::vector<Launch> launches;
};

/// An in-order queue. From the first call that fails on it is lost, for good: arguments were checked while setting up,
/// so what fails later is the device. The api outlives the stream.
std::unique_ptr<Stream> make_stream(const Api& api, Handle<cl_command_queue> queue);

}  // namespace berth::opencl
