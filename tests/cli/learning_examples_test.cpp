// SPDX-License-Identifier: Apache-2.0
// The examples that learn networks, or small versions of them: what they show, not that they run.
#include <cmath>

#include "command_support.h"
#include "dpde/runtime/npy.h"

namespace dpde::testing {
namespace {

class LearningExamples : public Command {
 protected:
  Json found(const std::string& file, const std::string& task, const std::string& options = "") const {
    const Outcome outcome = dpde("optimize " + file + " " + task + " --out out --threads 1 --json" + options);
    EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    return outcome.json();
  }
};

/// y^2 = x: examples of both roots are averaged to neither; the equation gives one of the roots at all points.
TEST_F(LearningExamples, TwoSolutions) {
  fs::copy(fs::path(DPDE_SOURCE_DIR) / "dsl-examples/two_solutions/two_solutions.dpde", path("t.dpde"));
  const Json examples = found("t.dpde", "examples"), equation = found("t.dpde", "equation");
  EXPECT_NEAR(examples["loss"].back().get<double>(), 0.5, 0.02) << "their variance";
  EXPECT_GT(examples["test"]["residual"].get<double>(), 0.3);
  EXPECT_LT(equation["test"]["residual"].get<double>(), 2e-6);
  ASSERT_EQ(dpde("run t.dpde curves --out out --json").status, 0);
  const NpyArray averaged = read_npy(path("out/averaged.npy")), solved = read_npy(path("out/solved.npy"));
  ASSERT_EQ(solved.values.size(), 200U);
  double mean = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    const double x = (static_cast<double>(i) + 0.5) / 200;
    EXPECT_NEAR(solved.values[i] * (solved.values[199] < 0 ? -1 : 1), std::sqrt(x), x < 0.05 ? 0.03 : 3e-3) << x;
    mean += averaged.values[i] / 200;
  }
  EXPECT_LT(std::abs(mean), 0.1);
}

}  // namespace
}  // namespace dpde::testing
