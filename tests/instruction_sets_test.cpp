// The simd backend leaves the reference's bits with every instruction set that it was compiled for and this processor
// has, not only with the best: conformance_test has that one.
#include "support/instruction_sets.hpp"

#include <gtest/gtest.h>

#include "berth/backend.hpp"
#include "support/op_case.hpp"

namespace berth {
namespace {

class EveryInstructionSet : public ::testing::TestWithParam<Op> {};

TEST_P(EveryInstructionSet, WritesTheReferenceBits) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const std::unique_ptr<Backend> simd = open_backend("simd");
  for (const cases::OpCase& op_case : cases::cases_for(GetParam())) {
    const auto expected = cases::run_case(op_case, *reference);
    test::for_each_instruction_set([&](const char* name) {
      EXPECT_EQ(cases::first_difference(op_case, expected, cases::run_case(op_case, *simd)), "") << name;
    });
  }
}

INSTANTIATE_TEST_SUITE_P(Ops, EveryInstructionSet, ::testing::ValuesIn(all_ops()),
                         [](const auto& tested) { return std::string(name_of(tested.param)); });

}  // namespace
}  // namespace berth
