#include "host/host_backend.hpp"

#include <chrono>
#include <cstring>
#include <fstream>
#include <new>

#include "berth/error.hpp"
#include "host/worker_pool.hpp"

namespace berth::host {
namespace {

/// Room that vector code may read (never write) past the end of a buffer.
constexpr std::size_t kReadSlack = 256;
constexpr std::size_t kAlignment = 64;

class HostBuffer final : public Buffer {
 public:
  explicit HostBuffer(std::size_t bytes)
      : Buffer(bytes),
        memory_(static_cast<unsigned char*>(
            ::operator new(bytes + kReadSlack, static_cast<std::align_val_t>(kAlignment)))) {
    std::memset(memory_.get(), 0, bytes + kReadSlack);
  }
  void* host() override { return memory_.get(); }

 private:
  struct Free {
    void operator()(unsigned char* memory) const {
      ::operator delete(memory, static_cast<std::align_val_t>(kAlignment));
    }
  };
  std::unique_ptr<unsigned char, Free> memory_;
};

struct Call {
  HostOp op;
  std::vector<std::byte> params;
  std::vector<void*> buffers;
  int groups;
};

class HostPlan final : public Plan {
 public:
  std::vector<Call> calls;
};

class HostEvent final : public Event {
 public:
  bool wait() override { return true; }
};

class HostStream final : public Stream {
 public:
  explicit HostStream(WorkerPool& pool) : pool_(pool) {}
  void upload(Buffer& buffer, const void* data, std::size_t bytes) override { std::memcpy(buffer.host(), data, bytes); }
  void download(Buffer& buffer, void* data, std::size_t bytes) override { std::memcpy(data, buffer.host(), bytes); }
  void replay(Plan& plan) override {
    for (const Call& call : static_cast<HostPlan&>(plan).calls) run(call);
  }
  std::unique_ptr<Event> record_event() override { return std::make_unique<HostEvent>(); }
  bool finish() override { return true; }
  std::vector<std::int64_t> time_steps(Plan& plan) override {
    std::vector<std::int64_t> times;
    for (const Call& call : static_cast<HostPlan&>(plan).calls) {
      const auto start = std::chrono::steady_clock::now();
      run(call);
      times.push_back(
          std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - start).count());
    }
    return times;
  }

 private:
  void run(const Call& call) {
    if (call.op.whole || pool_.threads() == 1) {
      call.op.run(call.params.data(), call.buffers.data(), 0, call.op.whole ? 1 : call.groups);
    } else {
      pool_.share(call.groups,
                  [&call](int first, int last) { call.op.run(call.params.data(), call.buffers.data(), first, last); });
    }
  }

  WorkerPool& pool_;
};

class HostBackend final : public Backend {
 public:
  HostBackend(const char* name, DeviceInfo device, const HostOps& ops, int threads)
      : name_(name), device_(std::move(device)), ops_(ops), pool_(threads) {}
  const char* name() const override { return name_; }
  DeviceInfo device() const override { return device_; }
  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override { return std::make_unique<HostBuffer>(bytes); }
  std::unique_ptr<Stream> make_stream() override { return std::make_unique<HostStream>(pool_); }
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
      plan->calls.push_back(std::move(call));
    }
    return plan;
  }

 private:
  const char* name_;
  DeviceInfo device_;
  HostOps ops_;
  WorkerPool pool_;
};

}  // namespace

std::unique_ptr<Backend> make_host_backend(const char* name, DeviceInfo device, const HostOps& ops, int threads) {
  return std::make_unique<HostBackend>(name, std::move(device), ops, threads);
}

DeviceInfo processor(const std::string& driver) {
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const std::size_t colon = line.find(": ");
    if (line.compare(0, 10, "model name") == 0 && colon != std::string::npos) return {line.substr(colon + 2), driver};
  }
  return {"processor", driver};
}

void check_device(const char* backend, const BackendOptions& options) {
  if (!options.device.empty() && options.device != "0") {
    throw Error(std::string(backend) + ": no device '" + options.device + "'; it has one, 0");
  }
}

}  // namespace berth::host
