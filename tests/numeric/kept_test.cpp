// SPDX-License-Identifier: Apache-2.0
// Gradients with stored intermediate values for the adjoint instead of states (adjoint/reverse/kept.h), against
// gradients without: by the interpreter, which has no such programs, and with few checkpoints.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/opened_scene.h"

namespace dpde {
namespace {

using testing::OpenedScene;

const std::string by_fields =
    "unknown c; unknown initial u; minimise mean(u^2) at t = 0.2; minimise mean(u) at t = 0.1";

/// This number of cells per axis; walls across y.
std::string scene(const std::string& equations, const std::string& times, const std::string& cells,
                  const std::string& task) {
  return "model m { field u; coefficient c; param a\n  " + equations +
         " }\nscheme r { lap = central(4); time = " + times + " }\nscene s : m with r {\n  grid x = 0 .. 1, cells " +
         cells + ", periodic\n  grid y = 0 .. 1, cells " + cells + "\n  grid z = 0 .. 1, cells " + cells +
         ", periodic\n  boundary u: y.low = 0.3, y.high = zero_gradient\n  c = 0.01*(1 + y)\n  a = 0.02\n"
         "  initial u = sin(2*pi*x)*cos(2*pi*z) + y\n  time 0 .. 0.2, step 0.01\n}\ntask t : s { " +
         task + " }\n";
}

std::string wave(const std::string& task, const std::string& cells = "5") {
  std::string text = scene("dt(dt(u)) = c*lap(u)", "leapfrog", cells, task);
  return text.insert(text.find("  time 0"), "  initial dt(u) = x\n");
}

struct Gradient {
  double loss = 0;
  std::vector<double> values;
  bool keeps = false;  // if there is memory for all steps
};
Gradient gradient_of(const std::string& text, driver::Backend backend, const std::string& real = "f64",
                     driver::SessionOptions options = {}, int times = 1) {
  OpenedScene opened(text, "t",
                     {.overrides = {{"real", real}}, .backend = backend, .adjoint = true, .session = options});
  const auto inverse = opened.inverse();
  if (!inverse) return {};
  Eigen::VectorXd gradient(inverse->size());
  Gradient found;
  for (int n = 0; n < times; ++n) found.loss = inverse->value_and_gradient(inverse->start(), gradient);
  found.values.assign(gradient.begin(), gradient.end());
  const auto plan = driver::plan_of_gradient(opened.session->compiled(), {});
  found.keeps = plan && plan->kept_fields > 0;
  return found;
}

void expect_near(const Gradient& found, const Gradient& expected, double tolerance) {
  ASSERT_EQ(found.values.size(), expected.values.size());
  ASSERT_FALSE(expected.values.empty());
  double largest = 0;
  for (const double value : expected.values) largest = std::max(largest, std::abs(value));
  for (std::size_t i = 0; i < found.values.size(); ++i)
    EXPECT_NEAR(found.values[i], expected.values[i], tolerance * largest) << i;
  EXPECT_NEAR(found.loss, expected.loss, tolerance * std::abs(expected.loss));
}

TEST(Kept, IsWhatTheAdjointReadsOfStates) {
  const std::string heat = scene("dt(u) = c*lap(u)", "euler", "5", by_fields);
  const std::string by_number =
      scene("dt(u) = c*lap(u) + a*lap(u)", "euler", "5", "unknown a; unknown c; minimise mean(u^2) at t = 0.2");
  for (const std::string& text : {wave(by_fields), wave(by_fields, "2"), wave(by_fields, "1"), heat, by_number}) {
    SCOPED_TRACE(text);
    for (const auto& [real, tolerance] : {std::pair{"f64", 1e-13}, {"f32", 2e-5}}) {
      const Gradient apart = gradient_of(text, driver::Backend::interpreter, real);
      const Gradient kept = gradient_of(text, driver::Backend::jit, real, {}, 2);
      EXPECT_TRUE(kept.keeps);
      EXPECT_FALSE(apart.keeps);
      expect_near(kept, apart, tolerance);
      expect_near(gradient_of(text, driver::Backend::jit, real, {.slots = 3}), apart, tolerance);
      expect_near(gradient_of(text, driver::Backend::jit, real, {.threads = 2}), apart, tolerance);
    }
  }
}

/// Not used if it needs more memory than states, if a step has stages, or if it saves little.
TEST(Kept, IsNotWhatCostsMore) {
  const auto keeps = [](const std::string& equations, const std::string& times) {
    return gradient_of(scene(equations, times, "4", "unknown c; minimise mean(u^2) at t = 0.2"), driver::Backend::jit)
        .keeps;
  };
  EXPECT_TRUE(keeps("dt(u) = c*lap(u)", "euler"));
  EXPECT_FALSE(keeps("dt(u) = c*lap(u) - a*u^2", "euler"));
  EXPECT_FALSE(keeps("dt(u) = c*lap(u)", "rk4"));
  EXPECT_FALSE(keeps("dt(u) = div(c*grad(u))", "euler"));
  EXPECT_FALSE(keeps("dt(u) = c*lap(u) + c*dx(u)^2", "euler"));
  EXPECT_FALSE(keeps("dt(u) = c*dx(u)", "euler"));
}

/// A loss along the way reads the states themselves; nothing is stored beyond the memory budget.
TEST(Kept, IsWithinTheBudget) {
  const auto plan_of = [](const std::string& loss, std::int64_t budget) {
    OpenedScene opened(scene("dt(u) = c*lap(u)", "euler", "4", "unknown c; minimise " + loss), "t", {.adjoint = true});
    return driver::plan_of_gradient(opened.session->compiled(), {.checkpoint_bytes = budget}).value();
  };
  const std::int64_t most = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(plan_of("mean(u^2) over time", most).kept_fields, 0);
  const GradientPlan plan = plan_of("mean(u^2) at t = 0.2", most);
  EXPECT_EQ(plan.kept_fields, 20);
  EXPECT_EQ(plan_of("mean(u^2) at t = 0.2", plan.checkpoint_bytes).kept_fields, 20);
  const GradientPlan less = plan_of("mean(u^2) at t = 0.2", plan.checkpoint_bytes - 1);
  EXPECT_EQ(less.kept_fields, 0);
  EXPECT_LT(less.checkpoint_bytes, plan.checkpoint_bytes);
}

}  // namespace
}  // namespace dpde
