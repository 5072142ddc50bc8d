#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Counts around the group's size, an offset begin, sums that wrap.
std::vector<OpCase> scan_cases() {
  std::vector<OpCase> cases = frame_cases(Op::scan);
  for (const int count : {0, 1, 127, 128, 129, 1000}) {
    const int first = count % 5;
    std::vector<u32> values(static_cast<std::size_t>(first + count + 1));
    pictures::Random random(static_cast<u64>(count));
    for (u32& value : values) value = static_cast<u32>(random.next());
    cases.push_back(make_case("count_" + std::to_string(count), scan_params{first, count}, {values}, kGroupSize));
  }
  return cases;
}

}  // namespace berth::cases
