#pragma once

#include <hwy/targets.h>

#include <cstdint>

namespace berth::test {

/// Calls use(name) with each instruction set in turn that Berth is compiled for and this processor has, as the best
/// there is.
template <class Use>
void for_each_instruction_set(const Use& use) {
  const std::int64_t all = hwy::SupportedTargets();
  for (std::int64_t left = all & HWY_TARGETS; left != 0; left &= left - 1) {
    const std::int64_t best = left & -left;
    hwy::SetSupportedTargetsForTest(all & ~(best - 1));
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    use(hwy::TargetName(best));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace berth::test
