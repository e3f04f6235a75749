// SPDX-License-Identifier: Apache-2.0
// The certificate of a steady state stays within its time, also in the linear solve of the adjoint and in runs next to
// its point.
#include <chrono>

#include "analysis/certificate/run_check.h"
#include "driver_support.h"

namespace dpde::testing {
namespace {

std::shared_ptr<const driver::Compiled> task_of_rest(const SourceFile& source, driver::Backend backend) {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.adjoint = true;
  options.backend = backend;
  return compiled(source, options);
}

/// Immediately at rest, but with thousands of products for the adjoint, as 1e-11 of a step is within the rounding of
/// its adjoint.
constexpr const char* rest_with_a_slow_way_back = R"(
model m { field u; param k; param f; dt(u) = k*lap(u) + k*(f - u) }
scheme c { time = rk4 }
scene s : m with c { k = 1e-11; f = 1; grid x = 0 .. 1, cells 8; grid y = 0 .. 1, cells 8; grid z = 0 .. 1, cells 8
  boundary u: all = 0
  initial u = x; time 0 .. 1e8, step 0.1, until steady 1e-8 }
task t : s { unknown f from 0.5; minimise mean(u^2) }
)";

TEST(SteadyBudget, HoldsOnTheWayBack) {
  const SourceFile source("slow.dpde", rest_with_a_slow_way_back);
  const auto scene = task_of_rest(source, driver::Backend::interpreter);
  ASSERT_TRUE(scene);
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  const analysis::RunCheck result = analysis::check_run(source, scene, 0.05);  // all of it takes 2 seconds
  EXPECT_LT(std::chrono::duration<double>(Clock::now() - start).count(), 1);
  EXPECT_TRUE(result.lacked_time);
  ASSERT_FALSE(result.left_out.empty());
  EXPECT_EQ(result.left_out.front(), "the steady state: no time");
}

/// Soon at rest for k = 1, but only after millions of steps for any other k. Bounds keep the certificate's point there.
constexpr const char* rest_that_is_far_beside_the_point = R"(
model m { field u; field w; param k = 1; param f = 2
  dt(u) = k*f - u
  dt(w) = (1 - w)/(1 + 1e11*(k - 1)^2) }
scene s : m { grid x = 0 .. 1, cells 8, periodic
  initial u = x; initial w = 0; time 0 .. 1e8, step 0.1, until steady 1e-12 }
task t : s { unknown k in 0.9999999 .. 1.0000001; unknown f; minimise mean(u^2) }
)";

/// Half of the time is for the steady state. It runs out in the first direction, and the short run has the other half.
TEST(SteadyBudget, LeavesTheOtherHalfToTheShortRun) {
  const SourceFile source("slow.dpde", rest_that_is_far_beside_the_point);
  const auto scene = task_of_rest(source, driver::Backend::jit);
  ASSERT_TRUE(scene);
  const analysis::RunCheck result = analysis::check_run(source, scene, 1);
  EXPECT_EQ(result.wrong, "");
  EXPECT_TRUE(result.lacked_time);
  EXPECT_FALSE(result.is_steady);
  EXPECT_EQ(result.directions, 2);
  EXPECT_EQ(result.left_out, std::vector<std::string>{"the steady state: no time"});
}

}  // namespace
}  // namespace dpde::testing
