// SPDX-License-Identifier: Apache-2.0
// Solves that find nothing: hosts are told where they stand in the text; an optimiser takes a shorter step.
#include <cmath>

#include "host_support.h"

namespace dpde::testing {
namespace {

/// One backward step from 0 is u = k + u^2: it has the solution (1 - sqrt(1 - 4*k))/2 up to k = 1/4.
const char* flame = R"(model m { field u; param k
  dt(u) = k + u^2 }
scheme c { time = backward_euler; implicit = all }
scene s : m with c {
  grid x = 0 .. 1, cells 2, periodic
  k = 0.2
  initial u = 0
  time 0 .. 1, step 1
}
task t : s {
  unknown k
  minimise mean((u - 0.45)^2)
  using lbfgs(), iterations 20
}
)";

TEST(SolvesOfHosts, SayWhereTheyStand) {
  Simulation sim = compile_text(flame, {.name = "t", .set = {{"k", "0.3"}}, .certify = false}, "flame.dpde");
  const auto expect_told = [](const auto& call) {
    try {
      call();
      ADD_FAILURE() << "there is no solution";
    } catch (const NoSolution& error) {
      ASSERT_EQ(error.messages().size(), 1);
      const Message& message = error.messages().front();
      EXPECT_EQ(message.code, "E0815");
      EXPECT_EQ(message.file, "flame.dpde");
      EXPECT_EQ(message.line, 2);
      EXPECT_EQ(message.text.find("step 1 of 1 (t = 0): newton for "), 0) << message.text;
      EXPECT_NE(std::string(error.what()).find("  dt(u) = k + u^2"), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find('^'), std::string::npos) << error.what();
    }
  };
  expect_told([&] { sim.step(); });
  expect_told([&] { sim.run(); });
  expect_told([&] { sim.loss(); });
  expect_told([&] { sim.gradient(); });
  expect_told([&] { sim.optimise(); });  // where it starts
}

/// u = 0.45 is that of k = 0.2475. The first step of the search is beyond 1/4.
TEST(SolvesOfHosts, ThatFindNothingAreStepsTooLong) {
  Simulation sim = compile_text(flame, {.name = "t"});
  sim.gradient();
  const double slope = sim.gradient_of("k").front(), u = (1 - std::sqrt(0.2)) / 2;
  EXPECT_NEAR(slope, 2 * (u - 0.45) / std::sqrt(0.2), 1e-9);
  EXPECT_GT(0.2 - slope, 0.25);
  const Optimised found = sim.optimise();
  EXPECT_GT(found.evaluations, found.iterations + 1);
  EXPECT_NEAR(sim.param("k"), 0.2475, 1e-6);
}

/// A gradient that is refused at one value says nothing of others: of an operator that is singular for k = 0 alone, and
/// of one that is not symmetric, whose right side is reached later.
TEST(SolvesOfHosts, AGradientThatIsRefusedRefusesNoLaterOne) {
  Simulation isolated = compile_text(R"(model m { field u; param k; coefficient f
  solve lap(psi) - k*psi = f for psi
  dt(u) = psi }
scene s : m { grid x = 0 .. 1, cells 12, periodic; k = 0; f = sin(2*pi*x) + 0.3; initial u = 0
  time 0 .. 0.1, step 0.05 }
task t : s { unknown k; minimise mean(u^2) })",
                                     {.name = "t"});
  EXPECT_THROW(isolated.gradient(), Error);
  isolated.set("k", 0.5);
  EXPECT_GT(isolated.gradient(), 0);
  Simulation unsymmetric = compile_text(R"(model m { field u; param b, c
  solve lap(psi) - b*dx(psi) = c*u for psi
  dt(u) = psi }
scene s : m { grid x = 0 .. 1, cells 12; b = 3; c = 1; initial u = x; boundary u: x = zero_gradient
  boundary psi: x = zero_gradient; time 0 .. 0.1, step 0.05 }
task t : s { unknown initial u; minimise mean(u^2) })",
                                        {.name = "t"});
  EXPECT_THROW(unsymmetric.gradient(), Error);
  unsymmetric.set("c", 0);
  EXPECT_GT(unsymmetric.gradient(), 0);
}

}  // namespace
}  // namespace dpde::testing
