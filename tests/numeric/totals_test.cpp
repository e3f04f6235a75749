// SPDX-License-Identifier: Apache-2.0
// Gradients by fields that the adjoint of a step accumulates itself (adjoint/reverse/accumulating_adjoint.h), against
// accumulation outside the step: by the interpreter, which has no such programs.
#include <gtest/gtest.h>

#include "support/opened_scene.h"

namespace dpde {
namespace {

using testing::OpenedScene;

const std::string text =
    "model m { field u, v; coefficient c, k; control field f; param a\n"
    "  dt(u) = c*lap(u) + div(k*grad(u)) + f*v; dt(v) = -a*v*c }\nscheme r { time = rk4 }\nscene s : m with r {\n"
    "  grid x = 0 .. 1, cells 7\n  grid y = 0 .. 1, cells 5, periodic\n"
    "  boundary u: x.low = 0.3, x.high = zero_gradient\n  boundary v: x = zero_gradient\n"
    "  c = 0.02 + 0.01*x\n  k = 0.01*(1 + y*(1 - y))\n  f = x*t every 0.1\n  a = 0.7\n"
    "  initial u = sin(2*pi*x)*cos(2*pi*y)\n  initial v = x\n  time 0 .. 0.5, step 0.01\n}\n"
    "task t : s { unknown c; unknown k; unknown f; unknown a\n"
    "  minimise mean(u^2) at t = 0.2, 0.5; minimise mean(v^2) at t = 0.5 }\n";

std::vector<double> gradient_by(driver::Backend backend, const std::string& real, bool again = false) {
  OpenedScene opened(text, "t", {.overrides = {{"real", real}}, .backend = backend, .adjoint = true});
  const auto inverse = opened.inverse();
  if (!inverse) return {};
  Eigen::VectorXd gradient(inverse->size());
  for (int n = 0; n < (again ? 2 : 1); ++n) inverse->value_and_gradient(inverse->start(), gradient);
  return {gradient.data(), gradient.data() + gradient.size()};
}

/// c and f are read at the point only, k also at neighbours: its adjoint is folded across walls and is not a total.
TEST(Totals, AreWhatIsAddedUpOutside) {
  for (const auto& [real, tolerance] : {std::pair{"f64", 1e-15}, {"f32", 1e-6}}) {
    const std::vector<double> apart = gradient_by(driver::Backend::interpreter, real);
    ASSERT_EQ(apart.size(), 35 + 35 + 5 * 35 + 1u);
    for (const auto& together :
         {gradient_by(driver::Backend::jit, real), gradient_by(driver::Backend::jit, real, true)}) {
      ASSERT_EQ(together.size(), apart.size());
      for (std::size_t i = 0; i < apart.size(); ++i) EXPECT_NEAR(together[i], apart[i], tolerance) << real << " " << i;
    }
  }
}

TEST(Totals, AreInputsOfAProgram) {
  OpenedScene opened(text, "t", {.adjoint = true});
  const loop::Module& module = opened.session->compiled().loop;
  const auto program = std::ranges::find(module.programs, "s_step_adjoint_accumulating", &loop::Program::name);
  ASSERT_NE(program, module.programs.end());
  const auto is_input = [&](const char* field) {
    const auto at = std::ranges::find(program->fields, field) - program->fields.begin();
    return at < program->input_count;
  };
  EXPECT_TRUE(is_input("c_bar") && is_input("f_bar"));
  EXPECT_FALSE(is_input("k_bar"));
}

}  // namespace
}  // namespace dpde
