// SPDX-License-Identifier: Apache-2.0
// Control fields and noise of host programs: values and gradients one interval after the other, formulas that follow
// parameters, and a source that is found in space and time.
#include <gtest/gtest.h>

#include <cmath>

#include "dpde/dpde.h"
#include "dpde/runtime/random.h"
#include "host_support.h"

namespace dpde::testing {
namespace {

using Numbers = std::vector<double>;

/// u grows by dt*F in each of 5 steps of 0.1; intervals of 2, 2 and 1 steps.
const char* const pushes =
    "model m { field u; control field F; param a; dt(u) = F }\nscheme e { time = euler }\nscene s : m with e {\n  grid "
    "x = 0 .. 1, cells 3, periodic\n"
    "  a = 2\n  initial u = x\n  F = a*x*t every 0.2\n  observe push = sum(F)\n  time 0 .. 0.5, step 0.1\n}\n"
    "task t : s {\n  unknown F\n  minimise mean(u^2)\n}\n";
constexpr double middle[] = {0.1, 0.3, 0.5}, length[] = {0.2, 0.2, 0.1};
double place(std::size_t i) { return (static_cast<double>(i) + 0.5) / 3; }

TEST(HostControlFields, AreSetAndDifferentiatedByInterval) {
  Simulation sim = compile_text(pushes, {.name = "t"});
  Numbers own;
  for (const double t : middle) {
    for (std::size_t i = 0; i < 3; ++i) own.push_back(2 * place(i) * t);
  }
  const Numbers begin = sim.value_of("F");
  ASSERT_EQ(begin.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(begin[i], own[i], 1e-15);
  const Numbers values = random_values(9, 3);
  for (const bool by_control : {false, true}) {
    by_control ? sim.set_control("F", values) : sim.set_field("F", values);
    EXPECT_EQ(sim.value_of("F"), values);
    sim.reset();
    sim.run();
    sim.gradient();
    for (std::size_t i = 0; i < 3; ++i) {
      double u = place(i);
      for (std::size_t k = 0; k < 3; ++k) u += length[k] * values[3 * k + i];
      EXPECT_NEAR(sim.state("u")[i], u, 1e-15);
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(sim.gradient_of("F")[3 * k + i], 2 * u * length[k] / 3, 1e-15);
    }
  }
  EXPECT_THROW(sim.set_field("F", Numbers(3)), Error);
}

/// A host may give a control what it has, or what another look at it said; rates of products are none of its controls.
TEST(HostControls, AreTheScenesAloneAndMayBeGivenThemselves) {
  Simulation sim = compile_text(R"(model m { field u; control f; dt(u) = f*u }
scheme e { time = euler }
scene s : m with e {
  grid x = 0 .. 1, cells 4, periodic
  f = 0.5 every 0.5
  initial u = 1 + x
  time 0 .. 1, step 0.25
}
task t : s { unknown f from 0.5; minimise 0.5*integral(u^2) }
)",
                                {.second_order = true});
  const double loss = sim.loss();
  const std::span<const double> f = sim.control("f");
  sim.set_control("f", f);
  EXPECT_EQ(sim.loss(), loss);
  sim.set_control("f", std::vector<double>(f.size(), 0.25));
  EXPECT_EQ(f[0], 0.25) << "the view stays one of the control";
  EXPECT_LT(sim.loss(), loss);
  sim.hessian_vector(std::vector<double>(f.size(), 1.0));
  EXPECT_THROW(sim.control("f_dot"), Error);
}

TEST(HostControlFields, FormulasFollowParametersAndObservablesTheTime) {
  Simulation sim = compile_text(pushes, {.name = "t"});
  sim.set("a", 4);
  for (std::size_t n = 0; n < 5; ++n) {
    EXPECT_NEAR(sim.observe("push"), 4 * 1.5 * middle[n / 2], 1e-14) << n;
    sim.step();
  }
  EXPECT_NEAR(sim.state("u")[1], 0.5 + 0.5 * 4 * (0.2 * 0.1 + 0.2 * 0.3 + 0.1 * 0.5), 1e-15);
  sim.step();  // beyond the end the last interval goes on
  EXPECT_NEAR(sim.state("u")[1], 0.5 + 0.5 * 4 * (0.2 * 0.1 + 0.2 * 0.3 + 0.2 * 0.5), 1e-15);
}

TEST(HostControlFields, NoiseIsThatOfTheCommand) {
  std::string text = pushes;
  text.replace(text.find("a*x*t"), 5, "noise(4)");
  text.replace(text.find("u = x"), 5, "u = a*noise(5)");
  Simulation sim = compile_text(text, {.name = "s"});
  sim.set("a", 3);
  sim.run();
  for (std::size_t i = 0; i < 3; ++i) {
    double u = 3 * normal(5, i);
    for (std::size_t k = 0; k < 3; ++k) u += length[k] * normal(4, i, k);
    EXPECT_NEAR(sim.state("u")[i], u, 1e-14);
  }
}

/// Where c is known at all times, so is its source: all of it is found, by Newton's method in one step and within
/// bounds.
TEST(HostControlFields, ASourceInSpaceAndTimeIsFound) {
  const std::string text =
      "model m { field c; param k; control field F; dt(c) = k*lap(c) + F }\nscheme e { time = rk2 }\nscene truth : m "
      "with e {\n"
      "  grid x = 0 .. 1, cells 12\n  boundary c: x = zero_gradient\n  k = 0.01\n  initial c = 0\n  F = exp(-40*(x - "
      "0.3 - 0.4*t)^2) every 0.2\n  time 0 .. 1, step 0.05\n}\n"
      "task t : truth {\n  data d = c from scene truth over time\n  unknown F from 0 in -1 .. 1.5\n  minimise mean((c "
      "- d)^2) over time\n"
      "  using newton_cg(hessian = gauss_newton), iterations 8\n}\n";
  Simulation sim = compile_text(text, {.name = "t", .second_order = true});
  const Optimised found = sim.optimise();
  EXPECT_LT(found.loss, 1e-20);
  const Numbers F = sim.value_of("F");
  ASSERT_EQ(F.size(), 60u);
  for (std::size_t k = 0; k < 5; ++k) {
    for (std::size_t i = 0; i < 12; ++i) {
      const double x = (static_cast<double>(i) + 0.5) / 12, t = 0.2 * (static_cast<double>(k) + 0.5);
      EXPECT_NEAR(F[12 * k + i], std::exp(-40 * std::pow(x - 0.3 - 0.4 * t, 2)), 1e-7) << k << ", " << i;
    }
  }
}

}  // namespace
}  // namespace dpde::testing
