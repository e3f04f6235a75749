// SPDX-License-Identifier: Apache-2.0
// What hosts hear of runs, losses and gradients that are not finite.
#include <gtest/gtest.h>

#include <cmath>

#include "dpde/dpde.h"

namespace dpde {
namespace {

/// u is squared once a step: 1e10, 1e20, ... 1e320 is not finite after step 5. Optimisers go on.
TEST(NotFinite, LossesOfRunsThatBlowUpAreErrors) {
  Simulation sim = compile_text(
      "model m {\n  field u\n  param p\n  dt(u) = p*u*u - u\n}\n"
      "scheme forward { time = euler }\nscene s : m with forward {\n  p = 1\n  grid x = 0 .. 4, cells 4, periodic\n  "
      "initial u = if(x > 2 and x < 3, 1e10, 0.5)\n"
      "  time 0 .. 9, step 1\n}\n"
      "task seek : s {\n  unknown p from 1\n  minimise mean(u^2) at t = 9\n}\n",
      {.second_order = true});
  const auto message = [&](const auto& call) -> std::string {
    try {
      call();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::run);
      return error.what();
    }
    return "no error";
  };
  const std::string expected =
      "u is no longer finite after step 5 of 9 (t = 5) in cell (2, 0, 0); a smaller step than 1 may help";
  EXPECT_EQ(message([&] { sim.loss(); }), expected);
  EXPECT_EQ(message([&] { sim.gradient(); }), expected);
  EXPECT_EQ(message([&] { sim.hessian_vector(std::vector{1.0}); }), expected);
  EXPECT_EQ(sim.optimise().reason, StopReason::not_finite);
  sim.reset();
  sim.step(7);
  EXPECT_EQ(message([&] { sim.state("u"); }),
            "u is no longer finite after 7 steps (t = 7) in cell (2, 0, 0); it was after 0; "
            "a smaller step than 1 may help");
  EXPECT_FALSE(std::isfinite(sim.state("u")[2])) << "it is said once";
  sim.set("p", 0);
  EXPECT_TRUE(std::isfinite(sim.loss()));
}

/// The states are finite here; sqrt(0) has no slope, log(0) no value.
TEST(NotFinite, LossesAndGradientsWithoutAValueAreErrors) {
  const auto message = [](const std::string& loss, const auto& call) -> std::string {
    Simulation sim = compile_text(
        "model m {\n  field u\n  param p\n  dt(u) = p - u\n}\n"
        "scene s : m {\n  p = 0\n  grid x = 0 .. 4, cells 4, periodic\n  initial u = 0\n"
        "  time 0 .. 1, step 0.5\n}\ntask seek : s {\n  unknown p from 0\n  minimise " +
        loss + " at t = 1\n}\n");
    try {
      call(sim);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::run);
      return error.what();
    }
    return "no error";
  };
  const auto loss = [](Simulation& sim) { sim.loss(); };
  const auto gradient = [](Simulation& sim) { sim.gradient(); };
  EXPECT_EQ(message("mean(sqrt(u))", loss), "no error");
  const std::string why =
      " is not finite, though all states are: a root or a power may have no derivative at 0, or a quotient no value";
  EXPECT_EQ(message("mean(sqrt(u))", gradient), "the gradient of the loss by p" + why);
  EXPECT_EQ(message("mean(log(u))", loss), "the loss" + why);
  EXPECT_EQ(message("mean(log(u))", gradient), "the loss" + why);
}

}  // namespace
}  // namespace dpde
