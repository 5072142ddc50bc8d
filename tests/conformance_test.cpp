// Every backend leaves the reference's bits in every buffer of every case, and in every stage of whole frames.
#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>

#include "support/op_case.hpp"

namespace berth {
namespace {

std::vector<std::string> backends_under_test() {
  std::vector<std::string> names;
  for (const BackendStatus& status : probe_backends()) {
    if (status.name != "reference" && !status.devices.empty()) names.push_back(status.name);
  }
  return names;
}

/// BERTH_EXPECT: backends that must be here, comma-separated.
std::vector<std::string> expected_backends() {
  const char* expected = std::getenv("BERTH_EXPECT");
  std::vector<std::string> names;
  std::istringstream list(expected == nullptr ? "" : expected);
  for (std::string name; std::getline(list, name, ',');) names.push_back(name);
  return names;
}

TEST(Backends, ExpectedOnesAreHere) {
  for (const std::string& name : expected_backends()) EXPECT_NO_THROW(open_backend(name)) << name;
}

TEST(Cases, EveryOperationHasSome) {
  for (const Op op : all_ops()) EXPECT_GE(cases::cases_for(op).size(), 4u) << name_of(op);
}

class EveryBackend : public ::testing::TestWithParam<std::tuple<std::string, Op>> {};

TEST_P(EveryBackend, WritesTheReferenceBits) {
  const auto& [name, op] = GetParam();
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const std::unique_ptr<Backend> backend = open_backend(name);
  for (const cases::OpCase& op_case : cases::cases_for(op)) {
    EXPECT_EQ(
        cases::first_difference(op_case, cases::run_case(op_case, *reference), cases::run_case(op_case, *backend)), "");
  }
}

std::string case_name(const ::testing::TestParamInfo<EveryBackend::ParamType>& tested) {
  return std::get<0>(tested.param) + "_" + name_of(std::get<1>(tested.param));
}

INSTANTIATE_TEST_SUITE_P(Ops, EveryBackend,
                         ::testing::Combine(::testing::ValuesIn(backends_under_test()), ::testing::ValuesIn(all_ops())),
                         case_name);

}  // namespace
}  // namespace berth
