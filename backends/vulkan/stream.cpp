// Copies are collected in a command buffer; a replay submits them and the plan at once; flush(), an event or finish()
// submits what was collected since. So a frame is two submissions: upload and plan, then the downloads; one where the
// host reaches the buffers itself. What a submission holds is a batch; batches end in the order they began.
#include "vulkan/stream.hpp"

#include <array>
#include <cassert>
#include <cstring>

#include "berth/error.hpp"

namespace berth::vulkan {
namespace {

constexpr std::size_t kBatches = 8;  // in flight; the host waits for the oldest before a ninth

class VkStream final : public Stream {
 public:
  VkStream(const Gpu& gpu, std::size_t staging_bytes)
      : gpu_(gpu),
        ring_(make_staging(gpu, staging_bytes), staging_bytes),
        pool_(gpu.make_command_pool(VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT)) {
    std::array<VkCommandBuffer, kBatches> commands = {};
    VkCommandBufferAllocateInfo allocation = {};
    allocation.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocation.commandPool = pool_.get();
    allocation.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    allocation.commandBufferCount = kBatches;
    check(gpu.api().vkAllocateCommandBuffers(gpu.get(), &allocation, commands.data()), "making a stream");
    for (std::size_t i = 0; i < kBatches; ++i) {
      batches_[i].commands = commands[i];
      batches_[i].fence = gpu.make_fence();
      batches_[i].deliveries.reserve(64);
    }
    touched_.reserve(64);
  }
  // The device may be at work for this stream until then. Downloads that nobody waited for are dropped.
  ~VkStream() override {
    while (done_ < submitted_ && wait_oldest()) done_ += 1;
  }

  void upload(Buffer& buffer, const void* data, std::size_t bytes) override {
    assert(bytes <= buffer.bytes());
    std::size_t at = 0;
    if (bytes == 0 || !begin_copy(buffer, bytes, true, at)) return;
    std::memcpy(ring_.host() + at, data, bytes);
    const VkBufferCopy region = {at, 0, bytes};
    gpu_.api().vkCmdCopyBuffer(batch().commands, ring_.handle(), handle_of(buffer), 1, &region);
  }

  void download(Buffer& buffer, void* data, std::size_t bytes) override {
    assert(bytes <= buffer.bytes());
    std::size_t at = 0;
    if (bytes == 0 || !begin_copy(buffer, bytes, false, at)) return;
    const VkBufferCopy region = {0, at, bytes};
    gpu_.api().vkCmdCopyBuffer(batch().commands, handle_of(buffer), ring_.handle(), 1, &region);
    batch().deliveries.push_back({at, data, bytes});
  }

  void replay(Plan& plan) override { submit(static_cast<VkPlan&>(plan).commands()); }

  void flush() override {
    if (copying_) submit(nullptr);
  }

  std::unique_ptr<Event> record_event() override {
    flush();
    return std::make_unique<VkMark>(*this, submitted_);
  }

  bool finish() override {
    flush();
    return wait_for(submitted_);
  }

  std::vector<std::int64_t> time_steps(Plan& plan) override {
    if (!finish()) return {};
    try {
      return static_cast<VkPlan&>(plan).time_steps();
    } catch (const Error&) {
      lost_ = true;
      return {};
    }
  }

 private:
  struct Delivery {
    std::size_t from;
    void* to;
    std::size_t bytes;
  };
  struct Batch {
    VkCommandBuffer commands = nullptr;
    Handle<VkFence> fence;
    std::vector<Delivery> deliveries;
    std::size_t staged = 0;
  };
  struct Touched {
    VkBuffer buffer;
    bool written;
  };

  class VkMark final : public Event {
   public:
    VkMark(VkStream& stream, u64 submission) : stream_(stream), submission_(submission) {}
    bool wait() override { return stream_.wait_for(submission_); }

   private:
    VkStream& stream_;
    u64 submission_;
  };

  static VkBuffer handle_of(Buffer& buffer) { return static_cast<VkStorage&>(buffer).handle(); }
  /// The batch that is being collected.
  Batch& batch() { return batches_[submitted_ % kBatches]; }

  /// Whatever fails on a running stream ends it.
  bool note(VkResult result) {
    lost_ = lost_ || result != VK_SUCCESS;
    return !lost_;
  }

  /// Finds room in the ring and puts the copy behind whatever it must come after. Returns false on a lost stream.
  bool begin_copy(Buffer& buffer, std::size_t bytes, bool writes, std::size_t& at) {
    if (lost_ || !take(bytes, at) || !open()) return false;
    const VkBuffer handle = handle_of(buffer);
    bool conflict = false;
    bool known = false;
    for (Touched& touched : touched_) {
      if (touched.buffer != handle) continue;
      conflict = writes || touched.written;
      touched.written = touched.written || writes;
      known = true;
    }
    if (conflict) barrier(gpu_.api(), batch().commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT);
    if (!known) touched_.push_back({handle, writes});
    return true;
  }

  /// Begins the batch's commands, after everything submitted before.
  bool open() {
    if (copying_) return true;
    if (submitted_ - done_ == kBatches && !retire_oldest()) return false;
    VkCommandBufferBeginInfo begin = {};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    if (!note(gpu_.api().vkBeginCommandBuffer(batch().commands, &begin))) return false;
    barrier(gpu_.api(), batch().commands, VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
            VK_PIPELINE_STAGE_TRANSFER_BIT);
    touched_.clear();
    copying_ = true;
    return true;
  }

  bool take(std::size_t bytes, std::size_t& at) {
    at = ring_.take(bytes);
    if (at != StagingRing::kNoRoom) return true;
    flush();
    while (at == StagingRing::kNoRoom && done_ < submitted_) {
      if (!retire_oldest()) return false;
      at = ring_.take(bytes);
    }
    if (at != StagingRing::kNoRoom) return true;
    try {  // larger than the whole ring, which nothing uses now
      const std::size_t room = bytes + 16;
      ring_ = StagingRing(make_staging(gpu_, room), room);
    } catch (const Error&) {
      lost_ = true;
      return false;
    }
    at = ring_.take(bytes);
    return true;
  }

  /// Submits the copies collected and then the plan, if any.
  void submit(VkCommandBuffer plan) {
    if (lost_ || (submitted_ - done_ == kBatches && !retire_oldest())) return;
    const Api& api = gpu_.api();
    Batch& now = batch();
    std::array<VkCommandBuffer, 2> commands = {};
    uint32_t count = 0;
    if (copying_) {
      if (!now.deliveries.empty()) {
        barrier(api, now.commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT);
      }
      copying_ = false;
      if (!note(api.vkEndCommandBuffer(now.commands))) return;
      commands[count++] = now.commands;
    }
    if (plan != nullptr) commands[count++] = plan;
    VkSubmitInfo info = {};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    info.commandBufferCount = count;
    info.pCommandBuffers = commands.data();
    if (!note(gpu_.submit(info, now.fence.get()))) return;
    now.staged = ring_.mark();
    submitted_ += 1;
  }

  bool wait_oldest() {
    const VkFence fence = batches_[done_ % kBatches].fence.get();
    return gpu_.api().vkWaitForFences(gpu_.get(), 1, &fence, VK_TRUE, UINT64_MAX) == VK_SUCCESS;
  }

  /// Waits for the oldest batch, hands over its downloads and makes it free for use.
  bool retire_oldest() {
    if (lost_ || !note(wait_oldest() ? VK_SUCCESS : VK_ERROR_DEVICE_LOST)) return false;
    Batch& oldest = batches_[done_ % kBatches];
    for (const Delivery& delivery : oldest.deliveries) {
      std::memcpy(delivery.to, ring_.host() + delivery.from, delivery.bytes);
    }
    oldest.deliveries.clear();
    ring_.give_back(oldest.staged);
    const VkFence fence = oldest.fence.get();
    done_ += 1;
    return note(gpu_.api().vkResetFences(gpu_.get(), 1, &fence));
  }

  bool wait_for(u64 submission) {
    while (!lost_ && done_ < submission) retire_oldest();
    return !lost_;
  }

  const Gpu& gpu_;
  StagingRing ring_;
  Handle<VkCommandPool> pool_;
  std::array<Batch, kBatches> batches_;
  std::vector<Touched> touched_;  // buffers that the open batch copies
  bool copying_ = false;          // the batch has begun
  u64 submitted_ = 0;             // batches, ever
  u64 done_ = 0;                  // of these, waited for
  bool lost_ = false;
};

}  // namespace

std::unique_ptr<Stream> make_stream(const Gpu& gpu, std::size_t staging_bytes) {
  return std::make_unique<VkStream>(gpu, staging_bytes);
}

}  // namespace berth::vulkan
