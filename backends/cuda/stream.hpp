#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "berth/backend.hpp"
#include "cuda/context.hpp"

namespace berth::cuda {

class CudaBuffer final : public Buffer {
 public:
  /// `total` counts the bytes of all buffers there are.
  CudaBuffer(std::size_t bytes, const Context& context, Handle<CUdeviceptr> memory, std::atomic<std::size_t>& total)
      : Buffer(bytes), context_(context), memory_(std::move(memory)), total_(total) {
    total_ += bytes;
  }
  ~CudaBuffer() override { total_ -= bytes(); }
  const Context* context() const { return &context_; }
  CUdeviceptr memory() const { return memory_.get(); }

 private:
  const Context& context_;
  Handle<CUdeviceptr> memory_;
  std::atomic<std::size_t>& total_;
};

/// One kernel with its arguments. It may move: the pointers are into the vectors' memory.
struct Launch {
  CUfunction function = nullptr;
  unsigned groups = 0;  // none: it is left out
  std::vector<CUdeviceptr> buffers;
  std::vector<std::byte> params;
  std::vector<void*> arguments;  // to each of the buffers, then to the params
};

class CudaPlan final : public Plan {
 public:
  std::vector<Launch> launches;  // one a step
  Handle<CUgraphExec> graph;     // all of the launches; none where they are launched one by one
};

/// An in-order queue. From the first call that fails on it is lost, for good: arguments were checked while setting up,
/// so what fails later is the device. Throws Error when there is no memory; `staging_bytes` are reserved for copies.
/// The context outlives it.
std::unique_ptr<Stream> make_stream(const Context& context, std::size_t staging_bytes);

}  // namespace berth::cuda
