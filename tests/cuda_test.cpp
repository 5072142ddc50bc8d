// The CUDA backend against a driver that keeps its books (tests/fake_cuda): the same bits, with graphs and without,
// and what becomes of every call that fails.
#ifdef BERTH_WITH_CUDA
#include "cuda/cuda.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fake_cuda/fake_driver.hpp"
#include "verify/verify.hpp"

namespace berth::cuda {
namespace {

class CudaDriver : public ::testing::TestWithParam<const char*> {
 protected:
  void TearDown() override {
    EXPECT_STREQ(driver.fake_cuda_complaints(), "");
    EXPECT_EQ(driver.fake_cuda_live(), 0);
  }
  FakeDriver driver{GetParam()};
};

TEST_P(CudaDriver, ComputesTheReferencesBits) {
  const std::unique_ptr<Backend> backend = open({});
  const std::unique_ptr<Backend> reference = open_backend("reference");
  const VerifyReport report = verify_backend(*backend, *reference);
  EXPECT_EQ(report.first_difference, "");
  EXPECT_TRUE(report.ok);
  EXPECT_GT(report.cases, 500);
  EXPECT_GT(report.frames, 10);
}

INSTANTIATE_TEST_SUITE_P(Variants, CudaDriver, ::testing::Values("current", "cuda10", "no_graphs"),
                         [](const auto& tested) { return std::string(tested.param); });

}  // namespace
}  // namespace berth::cuda
#endif
