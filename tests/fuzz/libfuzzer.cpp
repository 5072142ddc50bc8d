// libFuzzer's entry for the target that BERTH_FUZZ_TARGET names.
#include "fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* bytes, std::size_t count) {
  berth::fuzz::BERTH_FUZZ_TARGET(bytes, count);
  return 0;
}
