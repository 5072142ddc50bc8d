#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Gains at 0, 1, the rounding points and saturation.
std::vector<OpCase> flat_field_cases() {
  std::vector<OpCase> cases = frame_cases(Op::flat_field);
  for (const int words : {1, 127, 128, 300}) {
    std::vector<u32> gains(static_cast<std::size_t>(words) * 2);
    pictures::Random random(static_cast<u64>(words));
    const u32 choices[] = {0, 1, 2047, 2048, 4095, 4096, 4097, 8192, 65535};
    for (u32& pair : gains) pair = choices[random.below(9)] | choices[random.below(9)] << 16;
    cases.push_back(make_case("words_" + std::to_string(words), flat_field_params{words},
                              {random_bytes(static_cast<std::size_t>(words), {0, 1, 2, 127, 128, 254, 255}, 21), gains,
                               std::vector<u32>(static_cast<std::size_t>(words), 0xdeadbeef)},
                              words));
  }
  return cases;
}

}  // namespace berth::cases
