// SPDX-License-Identifier: Apache-2.0
// Growth of perturbations if a tolerance determines substeps.
#include "analysis/run/gradient_growth.h"
#include "driver_support.h"

namespace dpde::testing {
namespace {

/// A uniform linear equation: a substep multiplies state and perturbation by the same number. If both runs chose their
/// substeps independently, they would differ by the effect of the perturbation on the choice.
TEST(PerturbationGrowth, IsOfTheSameParts) {
  const SourceFile source("test.dpde", R"(
model m { field u; param r; dt(u) = r*(1 + 0.9*sin(7*t))*u }
scheme k { time = bs32 }
scene s : m with k {
  grid x = 0 .. 1, cells 4, periodic
  r = -1
  initial u = 1 + x
  time 0 .. 8, step 1/2, tolerance 1e-4, absolute 1e-3
}
)");
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  const auto scene = compiled(source, options);
  ASSERT_NE(scene, nullptr);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, scene, {}, sink);
  ASSERT_NE(session, nullptr);
  const auto found = analysis::growth_of_perturbation(*session, 16);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->relative, 0, 1e-6) << "with parts of their own 7e-4";
}

}  // namespace
}  // namespace dpde::testing
