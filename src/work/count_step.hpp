#pragma once

#include "berth/backend.hpp"
#include "work/counts.hpp"

namespace berth::work {

/// Runs a step's kernel text on buffers in host memory, as the `cpu` backend would, and counts what it does. Of `every`
/// groups one is run and stands for the others: only for operations whose groups are alike (the network's), and what
/// they write is then incomplete. Throws Error where a buffer is not in host memory.
StepWork count_step(const Step& step, int every = 1);

}  // namespace berth::work
