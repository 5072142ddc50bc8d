#include "support/faulty_backend.hpp"

#include <utility>

namespace berth::test {
namespace {

/// One plan a step, so that a fault can come between two.
struct FaultyPlan final : Plan {
  std::vector<Step> steps;
  std::vector<std::unique_ptr<Plan>> plans;
  int replays = -1;  // the first is the empty frame that every DeviceFrame begins with
  int epoch = 0;
  int number = 0;  // of all that were recorded
  void list_constants(std::vector<ConstantMemory>& to) const override {
    for (const auto& plan : plans) plan->list_constants(to);
  }
};

class FaultyEvent final : public Event {
 public:
  FaultyEvent(std::unique_ptr<Event> behind, const std::atomic<bool>& lost) : behind_(std::move(behind)), lost_(lost) {}
  bool wait() override { return behind_->wait() && !lost_; }

 private:
  std::unique_ptr<Event> behind_;
  const std::atomic<bool>& lost_;
};

class FaultyStream final : public ForwardingStream {
 public:
  FaultyStream(std::unique_ptr<Stream> behind, const Fault& fault, const int& epoch, std::atomic<bool>& lost)
      : ForwardingStream(std::move(behind)), fault_(fault), epoch_(epoch), lost_(lost) {}

  void replay(Plan& plan) override {
    FaultyPlan& faulty = static_cast<FaultyPlan&>(plan);
    if (faulty.epoch != epoch_) {
      faulty.epoch = epoch_;
      faulty.replays = 0;
    }
    const int frame = faulty.replays++;
    if (fault_.lose_frame >= 0 && frame >= fault_.lose_frame) lost_ = true;
    if (lost_) return;
    for (std::size_t i = 0; i < faulty.plans.size(); ++i) {
      const bool flips = static_cast<int>(i) == fault_.flip_step && frame == fault_.flip_frame &&
                         (fault_.flip_plan < 0 || fault_.flip_plan == faulty.number);
      if (flips && fault_.flip_before) flip(faulty.steps[i]);
      behind().replay(*faulty.plans[i]);
      if (flips && !fault_.flip_before) flip(faulty.steps[i]);
    }
  }
  std::unique_ptr<Event> record_event() override {
    return std::make_unique<FaultyEvent>(behind().record_event(), lost_);
  }
  bool finish() override { return behind().finish() && !lost_; }

 private:
  void flip(const Step& step) {
    Buffer& buffer = *step.buffers[static_cast<std::size_t>(fault_.flip_argument)];
    std::vector<u32> words(buffer.bytes() / 4);
    behind().download(buffer, words.data(), buffer.bytes());
    behind().finish();
    words[fault_.flip_word] ^= 1u << fault_.flip_bit;
    behind().upload(buffer, words.data(), buffer.bytes());
    behind().finish();
  }

  const Fault& fault_;
  const int& epoch_;
  std::atomic<bool>& lost_;
};

}  // namespace

FaultyBackend::FaultyBackend(Backend& behind, const Fault& fault)
    : ForwardingBackend("faulty", behind,
                        [this](std::unique_ptr<Stream> stream) {
                          return std::make_unique<FaultyStream>(std::move(stream), fault_, epoch_, lost_);
                        }),
      fault_(fault) {}

std::unique_ptr<Plan> FaultyBackend::record(const std::vector<Step>& steps) {
  auto plan = std::make_unique<FaultyPlan>();
  plan->steps = steps;
  plan->number = plans_++;
  for (const Step& step : steps) plan->plans.push_back(behind().record({step}));
  return plan;
}

void FaultyBackend::arm(const Fault& fault) {
  fault_ = fault;
  ++epoch_;
}

std::unique_ptr<FaultyBackend> make_faulty_backend(Backend& behind, const Fault& fault) {
  return std::make_unique<FaultyBackend>(behind, fault);
}

}  // namespace berth::test
