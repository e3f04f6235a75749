// SPDX-License-Identifier: Apache-2.0
// Nested differences of a whole equation become one sum over neighbours.
#include <gtest/gtest.h>

#include <string>

#include "model/from_ast.h"
#include "stencil/lower/from_model.h"
#include "stencil/passes/passes.h"
#include "stencil/passes/work.h"
#include "syntax/parser.h"

namespace dpde::stencil {
namespace {

/// A plasma's drift waves: two brackets, and three Laplacians of both fields.
const std::string drift_waves = R"(function fall(f) = dx(dx(f)) + dy(dy(f))
model drift_waves {
  field n, omega
  param c, kappa, nu
  solve lap(phi) = omega for phi
  dt(n) = c*(phi - n) - bracket(phi, n) - kappa*dy(phi) + nu*fall(fall(fall(n)))
  dt(omega) = c*(phi - n) - bracket(phi, omega) + nu*fall(fall(fall(omega)))
}
scheme nine_points { dx = central(2); lap = spectral; time = rk4 }
scene s : drift_waves with nine_points {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 8, periodic
  c = 1
  kappa = 1
  nu = 1e-8
  initial n = sin(2*pi*x)
  initial omega = cos(2*pi*y)
  time 0 .. 1, step 0.025
})";

TEST(Regroup, NestedDifferencesBecomeOneSum) {
  const SourceFile source("test.dpde", drift_waves);
  DiagnosticSink sink;
  const auto problem = model::from_ast(ast::parse(source, sink), {}, sink);
  ASSERT_TRUE(problem);
  Module before = from_model(*problem, program_names(*problem), sink);
  for (const Pass& pass : default_passes) before = pass.run(before);
  before = inline_lets(before);
  const Module after = regroup_updates(distribute_uniforms(before));
  int stages = 0;
  for (std::size_t k = 0; k < before.kernels.size(); ++k) {
    if (!before.kernels[k].name.starts_with("s_stage")) continue;
    ++stages;
    EXPECT_LT(2 * instructions(after.kernels[k]), instructions(before.kernels[k])) << before.kernels[k].name;
  }
  EXPECT_EQ(stages, 4);
}

}  // namespace
}  // namespace dpde::stencil
