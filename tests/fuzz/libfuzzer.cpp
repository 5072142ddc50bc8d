// libFuzzer's entry: for the target that BERTH_FUZZ_TARGET names when this is compiled, or else, in the environment.
#include <cstdio>
#include <cstdlib>

#include "fuzz/targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* bytes, std::size_t count) {
#ifdef BERTH_FUZZ_TARGET
  berth::fuzz::BERTH_FUZZ_TARGET(bytes, count);
#else
  static const berth::fuzz::Target* const target = [] {
    const char* const name = std::getenv("BERTH_FUZZ_TARGET");
    const berth::fuzz::Target* const found = name == nullptr ? nullptr : berth::fuzz::find_target(name);
    if (found == nullptr) {
      std::fputs("BERTH_FUZZ_TARGET names no target; see tests/fuzz/targets.cpp\n", stderr);
      std::exit(2);
    }
    return found;
  }();
  target->run(bytes, count);
#endif
  return 0;
}
