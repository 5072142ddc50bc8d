#include "soak_backends.hpp"

#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "berth/error.hpp"
#include "support/faulty_backend.hpp"

namespace berth::cli {
namespace {

constexpr std::chrono::milliseconds kStall{120}, kHang{700};
/// A scenario's device hangs so often, at frames so far apart.
constexpr int kStalls = 3, kStallEvery = 20;

/// Hangs in some frames, and then goes on as if nothing had been.
class StallingStream final : public test::ForwardingStream {
 public:
  StallingStream(std::unique_ptr<Stream> behind, int first) : ForwardingStream(std::move(behind)), next_(first) {}
  void replay(Plan& plan) override {
    if (replays_++ == next_ && stalls_ < kStalls) {
      ++stalls_;
      next_ += kStallEvery;
      std::this_thread::sleep_for(kStall);
    }
    behind().replay(plan);
  }

 private:
  int next_, replays_ = 0, stalls_ = 0;
};

/// Has nothing ready for a while once; kernels have long run by then, as they may have on a device whose driver hangs.
class HangingStream final : public test::ForwardingStream {
 public:
  HangingStream(std::unique_ptr<Stream> behind, int frame) : ForwardingStream(std::move(behind)), frame_(frame) {}
  bool is_immediate() const override { return false; }
  bool finish() override {
    if (finishes_++ == frame_) std::this_thread::sleep_for(kHang);
    return behind().finish();
  }

 private:
  int frame_, finishes_ = 0;
};

using Streams = std::unique_ptr<Stream>;

std::unique_ptr<Backend> lent(Backend& backend) {
  return std::make_unique<test::ForwardingBackend>(backend.name(), backend, [](Streams stream) { return stream; });
}

}  // namespace

SoakBackends::SoakBackends() {
  for (const std::string& name : backend_names()) {
    try {
      backends_[name] = open_backend(name);
      names_.push_back(name);
    } catch (const Error&) {
      // Not on this machine.
    }
  }
}

EngineBackends SoakBackends::lend(const SoakScenario& scenario) const {
  EngineBackends engine;
  engine.lockstep = scenario.lockstep;
  Backend& first = at(scenario.backend);
  switch (scenario.backend_fault) {
    case BackendFault::none:
      engine.backends.push_back(lent(first));
      break;
    case BackendFault::lost: {
      test::Fault fault;
      fault.lose_frame = scenario.backend_fault_frame;
      engine.backends.push_back(test::make_faulty_backend(first, fault));
      break;
    }
    case BackendFault::hung:
      engine.backends.push_back(std::make_unique<test::ForwardingBackend>(
          first.name(), first, [frame = scenario.backend_fault_frame](Streams stream) {
            return std::make_unique<HangingStream>(std::move(stream), frame);
          }));
      break;
    case BackendFault::stalled:
      engine.backends.push_back(std::make_unique<test::ForwardingBackend>(
          first.name(), first, [frame = scenario.backend_fault_frame](Streams stream) {
            return std::make_unique<StallingStream>(std::move(stream), frame);
          }));
      break;
  }
  if (scenario.lockstep || scenario.loses_backend()) engine.backends.push_back(lent(at(scenario.second)));
  if (scenario.fail_back) {
    // Without the fault: the device was reset meanwhile.
    engine.reopen = [this, names = std::array{scenario.backend, scenario.second}](std::size_t i) {
      return lent(at(names.at(i)));
    };
  }
  return engine;
}

}  // namespace berth::cli
