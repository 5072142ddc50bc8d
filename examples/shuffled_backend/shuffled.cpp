#include "shuffled.hpp"

#include <algorithm>
#include <cstring>
#include <random>
#include <utility>

#include "berth/error.hpp"
#include "cpu/cpu_backend.hpp"

namespace berth::shuffled {
namespace {

// 1. Memory. This device's is the host's; a true device would keep a handle here, and leave host() as it is: null.
class Memory final : public Buffer {
 public:
  explicit Memory(std::size_t bytes) : Buffer(bytes), words_((bytes + 3) / 4) {}
  void* data() { return words_.data(); }

 private:
  std::vector<u32> words_;  // zeroed, as Buffer promises
};

// 2. A plan: all that a frame will need, worked out once. Replaying it must allocate nothing.
struct Launch {
  host::HostOp op;
  std::vector<std::byte> params;
  std::vector<void*> buffers;
  std::vector<int> order;  // of its work-groups
};
struct Launches final : Plan {
  std::vector<Launch> list;
};

// 3. A stream: copies and plans, in order. Work is done as it is enqueued, so there is never anything to wait for.
class Done final : public Event {
 public:
  bool wait() override { return true; }  // false would say that the device is lost
};

class Queue final : public Stream {
 public:
  void upload(Buffer& buffer, const void* data, std::size_t bytes) override {
    std::memcpy(static_cast<Memory&>(buffer).data(), data, bytes);
  }
  void download(Buffer& buffer, void* data, std::size_t bytes) override {
    std::memcpy(data, static_cast<Memory&>(buffer).data(), bytes);
  }
  void replay(Plan& plan) override {
    for (Launch& launch : static_cast<Launches&>(plan).list) {
      std::shuffle(launch.order.begin(), launch.order.end(), random_);
      for (const int group : launch.order) launch.op.run(launch.params.data(), launch.buffers.data(), group, group + 1);
    }
  }
  std::unique_ptr<Event> record_event() override { return std::make_unique<Done>(); }
  bool is_immediate() const override { return true; }
  bool finish() override { return true; }

 private:
  std::mt19937 random_;
};

// 4. The device: makes the other three. It knows no operation by name, only where to find its kernels.
class Shuffled final : public Backend {
 public:
  const char* name() const override { return "shuffled"; }
  DeviceInfo device() const override { return host::processor("groups in any order"); }
  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override { return std::make_unique<Memory>(bytes); }
  std::unique_ptr<Stream> make_stream() override { return std::make_unique<Queue>(); }
  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override {
    auto plan = std::make_unique<Launches>();
    for (const Step& step : steps) {
      Launch launch{kernels_.ops[static_cast<std::size_t>(step.op)], step.params, {}, {}};
      for (Buffer* buffer : step.buffers) launch.buffers.push_back(static_cast<Memory*>(buffer)->data());
      const int groups = (step.items + kGroupSize - 1) / kGroupSize;
      for (int group = 0; group < groups; ++group) launch.order.push_back(group);
      plan->list.push_back(std::move(launch));
    }
    return plan;
  }

 private:
  const host::HostOps kernels_ = cpu_backend::ops();
};

}  // namespace

// 5. The entry for the registry. A device whose driver is missing leaves the list empty and says why in `absent`.
BackendEntry entry() {
  return {"shuffled", [](std::string&) { return std::vector<DeviceInfo>{host::processor("groups in any order")}; },
          [](const BackendOptions& options) -> std::unique_ptr<Backend> {
            host::check_device("shuffled", options);
            return std::make_unique<Shuffled>();
          }};
}

}  // namespace berth::shuffled
