// From pixels to poses, to the last bit, against a file: the same under every backend, compiler, instruction set and
// processor (docs/arithmetic.md).
#include <gtest/gtest.h>

#include "berth/backend.hpp"
#include "golden/scenes.hpp"
#include "support/instruction_sets.hpp"

namespace berth::golden {
namespace {

const std::string kRoot = BERTH_SOURCE_DIR;
const std::string kData = BERTH_TEST_DATA;

const Scenes& scenes() {
  static const Scenes all = render_scenes(kRoot);
  return all;
}

std::string difference_of_frames(const std::string& backend) {
  const auto device = open_backend(backend);
  return first_difference(read_lines(kData + "/golden_frames.txt"), frame_lines(scenes(), *device, kRoot));
}

std::string difference_of_the_network(const std::string& backend) {
  const auto device = open_backend(backend);
  return first_difference(read_lines(kData + "/golden_network.txt"), network_lines(scenes(), *device, kRoot));
}

class Golden : public ::testing::TestWithParam<std::string> {};

TEST_P(Golden, FramesToTheLastBit) { EXPECT_EQ(difference_of_frames(GetParam()), ""); }

TEST_P(Golden, NetworkToTheLastBit) {
  if (GetParam() == "reference") GTEST_SKIP() << "takes seconds a window; conformance_test has its operations";
  EXPECT_EQ(difference_of_the_network(GetParam()), "");
}

std::vector<std::string> backends_under_test() {
  std::vector<std::string> names;
  for (const BackendStatus& status : probe_backends()) {
    if (status.name != "simd" && !status.devices.empty()) names.push_back(status.name);
  }
  return names;
}

INSTANTIATE_TEST_SUITE_P(Backends, Golden, ::testing::ValuesIn(backends_under_test()),
                         [](const auto& tested) { return tested.param; });

TEST(GoldenSimd, ToTheLastBitOnEveryInstructionSet) {
  std::string names;
  test::for_each_instruction_set([&names](const char* name) {
    names += std::string(" ") + name;
    EXPECT_EQ(difference_of_frames("simd"), "") << name;
    EXPECT_EQ(difference_of_the_network("simd"), "") << name;
  });
  std::printf("instruction sets:%s\n", names.c_str());
}

TEST(GoldenLines, NameTheFirstValueThatDiffers) {
  const double values[] = {0.1, 0.2, 0.30000000000000004};
  const double others[] = {0.1, 0.2, 0.3};
  Lines one, other;
  one.numbers("corners of a", values, 3);
  other.numbers("corners of a", others, 3);
  EXPECT_EQ(first_difference(one.all(), one.all()), "");
  EXPECT_EQ(first_difference(one.all(), other.all()), "corners of a, value 3 of 3: 0.3 instead of 0.30000000000000004");
  EXPECT_EQ(first_difference({}, one.all()), "'corners of a' where there should be nothing");
  EXPECT_EQ(first_difference(one.all(), {}), "nothing where there should be 'corners of a'");
  Lines zero, negative_zero;
  const double zeros[] = {0.0, -0.0};
  zero.digest("t", zeros, 1);
  negative_zero.digest("t", zeros + 1, 1);
  EXPECT_NE(first_difference(zero.all(), negative_zero.all()), "");
}

}  // namespace
}  // namespace berth::golden
