#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "support/forwarding_backend.hpp"

namespace berth::test {

/// What goes wrong on a backend, and in which frame: each plan counts its replays from 0, the empty one at start apart.
struct Fault {
  /// A bit that turns over in a step's buffer right after the step, or right before it; none where step < 0.
  int flip_step = -1;
  bool flip_before = false;
  int flip_argument = 0;
  std::size_t flip_word = 0;
  int flip_bit = 0;
  int flip_frame = 0;
  /// Of the plans in the order they were recorded, the one in which it does; any where negative.
  int flip_plan = -1;
  /// The frame in which the device is lost for good; never where negative.
  int lose_frame = -1;
};

/// A backend that works as the one behind it does, but for one fault. The backend behind outlives it.
class FaultyBackend final : public ForwardingBackend {
 public:
  FaultyBackend(Backend& behind, const Fault& fault);
  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override;
  /// Another fault, and every plan's replays counted from 0 again. Only while no frame is under way.
  void arm(const Fault& fault);

 private:
  Fault fault_;
  int plans_ = 0;                   // recorded
  int epoch_ = 0;                   // of counting
  std::atomic<bool> lost_ = false;  // streams of several threads see it
};

std::unique_ptr<FaultyBackend> make_faulty_backend(Backend& behind, const Fault& fault);

}  // namespace berth::test
