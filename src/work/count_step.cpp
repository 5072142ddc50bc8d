#include "work/count_step.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "berth/error.hpp"
#include "reference/reference.hpp"
#include "work/counted.hpp"

namespace berth::work {
namespace counted {
namespace {

void add(Counts& sum, const Counts& more, std::uint64_t times) {
  for (std::size_t k = 0; k < kKinds; ++k) sum[k] += more[k] * times;
}
std::uint64_t total(const Counts& counts) { return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}); }

}  // namespace

void Meter::begin_group() {
  tally = {};
  uniform_ = {};
  group_floor_ = {};
  group_span_ = group_all_ = 0;
}

void Meter::begin_phase() {
  add(uniform_, tally.counts, 1);
  tally.counts = {};
  group_floor_ = longer(group_floor_, tally.floor);
  phase_span_ = 0;
  item_ = 0;
  longest_ = {};
}

void Meter::begin_item() {
  tally.counts = {};
  tally.floor = group_floor_;
}

void Meter::end_item() {
  const std::uint64_t all = total(tally.counts);
  phase_span_ = std::max(phase_span_, all);
  group_all_ += all;
  ++item_;
  for (std::size_t w = 0; w < kLockstep.size(); ++w) {
    for (std::size_t k = 0; k < kKinds; ++k) longest_[w][k] = std::max(longest_[w][k], tally.counts[k]);
    if (item_ % kLockstep[w] == 0) close_lockstep(w);
  }
}

void Meter::close_lockstep(std::size_t width) {
  add(work_.slots[width], longest_[width], static_cast<std::uint64_t>(kLockstep[width]));
  longest_[width] = {};
}

void Meter::end_phase() {
  for (std::size_t w = 0; w < kLockstep.size(); ++w) close_lockstep(w);
  group_span_ += phase_span_;
  group_floor_ = longer(group_floor_, tally.longest);  // the barrier
  tally.floor = group_floor_;
  tally.counts = {};
}

void Meter::end_group() {
  add(uniform_, tally.counts, 1);
  for (std::size_t w = 0; w < kLockstep.size(); ++w) {
    add(work_.slots[w], uniform_, static_cast<std::uint64_t>(kLockstep[w]));
  }
  work_.span = std::max(work_.span, group_span_ + total(uniform_));
  work_.most_in_group = std::max(work_.most_in_group, group_all_ + total(uniform_));
  work_.chain = std::max(work_.chain, tally.longest.loads);
  work_.steps = std::max(work_.steps, tally.longest.steps);
}

}  // namespace counted

namespace {

// The kernel text spells its types out; here they are the counting ones. Nothing but the text lies between the two.
namespace kernel {
using u32 = counted::Word<::berth::u32>;
using s32 = counted::Word<::berth::s32>;
using counted::bytes_ge;
using counted::bytes_max;
using counted::bytes_min;
using counted::dot_s8;
using counted::max;
using counted::min;
#if defined(__clang__)
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wkeyword-macro"
#endif
// clang-format off
#include "work/counting_prelude.h"
#define int s32
#include "all.inl"
#undef int
// clang-format on
#if defined(__clang__)
#pragma clang diagnostic pop
#endif
}  // namespace kernel

template <class T>
struct Argument {
  using type = counted::Output<T>;
};
template <class T>
struct Argument<const T> {
  using type = counted::Input<T>;
};

// The kernel text and the reference take the same buffers in the same order: the types come from the reference.
template <class Reference>
struct Text;
template <class P, class... T>
struct Text<void(const P&, T*...)> {
  using Kernel = void (*)(counted::Word<s32>, typename Argument<T>::type..., const P&);

  template <std::size_t... I>
  static void run(Kernel kernel, const Step& step, s32 group, std::index_sequence<I...>) {
    kernel({group}, {static_cast<T*>(step.buffers[I]->host())}..., *reinterpret_cast<const P*>(step.params.data()));
  }
  static void run(Kernel kernel, const Step& step, s32 group) {
    run(kernel, step, group, std::index_sequence_for<T...>{});
  }
};

void run_group(const Step& step, s32 group) {
  switch (step.op) {
#define X(op)                                                     \
  case Op::op:                                                    \
    Text<decltype(reference::op)>::run(&kernel::op, step, group); \
    break;
    BERTH_OPS(X)
#undef X
  }
}

/// The counts of `counted` groups, for `groups`.
void scale(StepWork& work, int counted, int groups) {
  for (Counts& counts : work.slots) {
    for (std::uint64_t& count : counts)
      count = count * static_cast<std::uint64_t>(groups) / static_cast<std::uint64_t>(counted);
  }
}

}  // namespace

std::size_t lockstep_index(int items) {
  const auto found = std::find(kLockstep.begin(), kLockstep.end(), items);
  if (found == kLockstep.end()) throw Error(std::to_string(items) + " items in lockstep; use 1, 4, 8, 16, 32 or 64");
  return static_cast<std::size_t>(found - kLockstep.begin());
}

StepWork count_step(const Step& step, int every) {
  for (Buffer* buffer : step.buffers) {
    if (buffer->host() == nullptr) {
      throw Error(std::string(name_of(step.op)) + ": a buffer is not in host memory; count on the backend cpu");
    }
  }
  counted::Meter meter;
  counted::meter = &meter;
  const int groups = (step.items + kGroupSize - 1) / kGroupSize;
  int done = 0;
  for (int group = 0; group < groups; group += every, ++done) {
    meter.begin_group();
    run_group(step, group);
    meter.end_group();
  }
  counted::meter = nullptr;
  StepWork work = meter.work();
  work.op = step.op;
  work.groups = groups;
  if (done < groups) scale(work, done, groups);
  return work;
}

}  // namespace berth::work
