// The example of docs/adding-a-backend.md passes what every backend must.
#include <gtest/gtest.h>

#include "shuffled_backend/shuffled.hpp"
#include "verify/verify.hpp"

namespace berth {
namespace {

TEST(ExampleBackend, PassesTheConformanceCases) {
  const std::unique_ptr<Backend> candidate = shuffled::entry().open({});
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const VerifyReport report = verify_backend(*candidate, *reference);
  EXPECT_TRUE(report.ok) << report.first_difference;
  EXPECT_GT(report.cases, 500);
  EXPECT_GT(report.frames, 10);
}

TEST(ExampleBackend, TakesNoOtherDevice) {
  BackendOptions options;
  options.device = "7";
  EXPECT_ANY_THROW(shuffled::entry().open(options));
}

}  // namespace
}  // namespace berth
