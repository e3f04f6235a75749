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

/// Explicit diffusion beyond its limit: told at the end of the run, whatever set the values.
TEST(NotFinite, WhatGrowsLikeAStepThatIsTooLargeIsSaid) {
  Simulation sim = compile_text(R"(model heat { field u; param D; dt(u) = D*lap(u) }
scheme forward { time = euler }
scene rod : heat with forward { D = 0.05
  grid x = 0 .. 1, cells 50, periodic; initial u = exp(-20*(x - 0.3)^2); time 0 .. 1, step 1/400 }
task fit : rod { unknown D from 0.05; minimise mean(u^2) at t = 1 }
)");
  const auto message = [&](const auto& call) -> std::string {
    try {
      call();
    } catch (const NotFinite& error) {
      return error.what();
    }
    return "no error";
  };
  sim.run();
  EXPECT_EQ(sim.growth(), "");
  EXPECT_TRUE(std::isfinite(sim.gradient()));
  sim.set("D", 0.12);  // 1 - 4*D*dt/h^2 = -2: 2^400 = 3e120
  sim.reset();
  EXPECT_NE(message([&] { sim.run(); }).find("u has grown from "), std::string::npos);
  EXPECT_NE(message([&] { sim.loss(); }).find("the step 0.0025 may be too large"), std::string::npos);
  EXPECT_NE(message([&] { sim.gradient(); }).find("the step 0.0025 may be too large"), std::string::npos);
  sim.reset();
  EXPECT_NE(message([&] { sim.step(400); }).find("u has grown from "), std::string::npos);
  sim.set("D", 0.083);  // 1.075^400 = 4e12 of the shortest wave
  sim.set_initial("u", [] {
    std::vector<double> wave(50);
    for (std::size_t i = 0; i < wave.size(); ++i) wave[i] = i % 2 == 0 ? 1 : -1;
    return wave;
  }());
  sim.reset();
  sim.run();
  EXPECT_NE(sim.growth().find("u has grown from 1 to "), std::string::npos) << sim.growth();
  sim.reset();
  EXPECT_EQ(sim.growth(), "");
  sim.run_to(0.9);
  const std::string judged = sim.growth();
  EXPECT_NE(judged.find(" in 360 steps"), std::string::npos) << judged;
  sim.run_to(0.95);  // 4 times as large: no other verdict
  EXPECT_EQ(sim.growth(), judged);
  sim.set("D", 0.01);
  sim.reset();
  sim.run();
  EXPECT_EQ(sim.growth(), "");
}

/// Losses and gradients say what runs say, and each set of parameters has a verdict of its own.
TEST(NotFinite, LossesAndGradientsSayWhatGrows) {
  const std::string text = R"(model heat { field u; param D; dt(u) = D*lap(u) }
scheme forward { time = euler }
scene rod : heat with forward { D = 0.05
  grid x = 0 .. 1, cells 50, periodic; initial u = cos(50*pi*(x - 0.01)); time 0 .. 1, step 1/400 }
scene parts : heat with forward { D = 0.02
  grid x = 0 .. 1, cells 50, periodic; initial u = cos(50*pi*(x - 0.01)); time 0 .. 1, step 1/200, courant 1, speed 8 }
task late : rod { unknown D from 0.05; minimise mean(u^2) at t = 1 }
task early : rod { unknown D from 0.05; minimise mean(u^2) at t = 0.5; minimise mean(u^2) at t = 0.8 }
task split : parts { unknown D from 0.02; unknown initial u; minimise mean(u^2) at t = 1 }
)";
  for (const std::string task : {"late", "early", "split"}) {
    for (const int slots : {0, 3}) {
      SCOPED_TRACE(task);
      Simulation sim = compile_text(text, {.name = task, .slots = slots, .certify = false});
      const auto gradient = [&] { return sim.gradient(), sim.growth(); };
      const auto loss = [&] { return sim.loss(), sim.growth(); };
      EXPECT_EQ(gradient(), "");
      sim.set("D", 0.086);  // a factor of 1.15 each time
      const std::string said = gradient();
      EXPECT_NE(said.find("u has grown from 1 to "), std::string::npos) << said;
      EXPECT_NE(said.find(task == "early" ? " in 320 steps: " : " steps: "), std::string::npos) << said;
      EXPECT_EQ(loss(), said);
      sim.set("D", 0.0861);
      EXPECT_NE(loss(), said);
      EXPECT_EQ(gradient(), sim.growth());
      sim.set("D", 0.05);
      EXPECT_EQ(loss(), "");
      sim.set("D", 0.086);
      EXPECT_EQ(loss(), said);
      EXPECT_EQ(gradient(), said);
      sim.set("D", 0.01);
      sim.reset(), sim.run();
      EXPECT_EQ(sim.growth(), "") << "it is that of the last one";
    }
  }
}

/// What grows by right is no mistake of the step, nor is what others drive.
TEST(NotFinite, WhatIsDrivenIsNoGrowth) {
  Simulation sim = compile_text(R"(model m { field u; dt(u) = 1 - u }
scene s : m { initial u = 1e-60; time 0 .. 20, step 0.1 }
)");
  sim.step(100);
  EXPECT_NEAR(sim.state("u")[0], 1, 1e-3);
  Simulation task = compile_text(R"(model m { field u; param a; dt(u) = a - u }
scene s : m { a = 1; initial u = 1e-12; time 0 .. 20, step 0.1 }
task t : s { unknown a from 1; minimise u^2 at t = 20 }
)");
  EXPECT_NEAR(task.loss(), 1, 1e-3);
  EXPECT_EQ(task.growth(), "");
  EXPECT_NEAR(task.gradient(), 1, 1e-3);
  EXPECT_EQ(task.growth(), "");
}

/// Progress may read and end a run, and make no other of the same simulation.
TEST(Progress, RunsNothingFromInside) {
  Simulation sim = compile_text(R"(model m { field u; dt(u) = -u }
scene s : m { initial u = 1; time 0 .. 1, step 0.1 }
)");
  int calls = 0;
  const auto inside = [&](const auto& what) {
    sim.reset();
    sim.run(
        [&](const Progress&) {
          ++calls;
          EXPECT_GT(sim.state("u")[0], 0);
          EXPECT_THROW(what(), Error);
          return true;
        },
        5);
    EXPECT_EQ(sim.steps_done(), 10);
  };
  inside([&] { sim.step(); });
  inside([&] { sim.run(); });
  inside([&] { sim.run_to(1); });
  inside([&] { sim.reset(); });
  EXPECT_EQ(calls, 8);
  sim.reset();
  EXPECT_TRUE(sim.step());
}

}  // namespace
}  // namespace dpde
