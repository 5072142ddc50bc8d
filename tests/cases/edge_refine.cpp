#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Beyond the frames: other pictures under the same quadrilaterals, so that edges are missing, turned round or far off,
// and no contrast asked for at all.
std::vector<OpCase> edge_refine_cases() {
  std::vector<OpCase> cases = frame_cases(Op::edge_refine);
  const std::size_t made = cases.size();
  for (std::size_t i = 0; i < made; ++i) {
    OpCase changed = cases[i];
    changed.buffers[0] = random_bytes(changed.buffers[0].size(), {0, 3, 100, 128, 255}, i);
    changed.buffers[1][3] = static_cast<u32>(i % 3 * 40);
    changed.name += "_other_picture";
    cases.push_back(changed);
  }
  return cases;
}

}  // namespace berth::cases
