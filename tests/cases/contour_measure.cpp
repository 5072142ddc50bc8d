#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Beyond the frames: the limits on side and area decide, and each polarity alone.
std::vector<OpCase> contour_measure_cases() {
  std::vector<OpCase> cases = frame_cases(Op::contour_measure);
  const std::size_t made = cases.size();
  for (std::size_t i = 0; i < made; ++i) {
    OpCase changed = cases[i];
    contour_measure_params& p = *reinterpret_cast<contour_measure_params*>(changed.params.data());
    p.min_side = 1;
    p.min_area = 1;
    p.max_side = 40;
    p.want_outer = i % 2 == 0 ? 1 : 0;
    p.want_holes = 1;
    changed.name += "_limits";
    cases.push_back(changed);
  }
  return cases;
}

}  // namespace berth::cases
