// SPDX-License-Identifier: Apache-2.0
// Gradients whose formulas divide by what loses its sign in the run: hosts are told, compiled in memory or built ahead
// of time.
#include "host_support.h"

namespace dpde::testing {
namespace {

/// p falls from 1 by k, and is 0 at 1/k.
const char* falling = R"(model m { field p, q; param k = 0.7; param a = 1
  dt(p) = -k
  dt(q) = atan(1/p) }
scene s : m {
  grid x = 0 .. 1, cells 3, periodic
  initial p = a + x
  initial q = 0
  time 0 .. 1, step 1/100
}
task t : s {
  unknown k
  minimise mean((q + 1)^2)
}
)";

using SignsOfHosts = InFolder;

TEST_F(SignsOfHosts, AreSaidWhereTheyAreLost) {
  Simulation sim = compile_text(falling, {.name = "t", .certify = false}, "falling.dpde");
  sim.gradient();
  const auto expect_told = [&](const std::string& what) {
    try {
      sim.gradient();
      ADD_FAILURE() << what;
    } catch (const NoSolution& error) {
      ASSERT_EQ(error.messages().size(), 1u);
      EXPECT_EQ(error.messages().front().code, "E0609");
      EXPECT_EQ(error.messages().front().line, 3);
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  sim.set("k", 2);
  expect_told("this divides by p, which changes its sign");
  EXPECT_GT(sim.loss(), 0) << "a loss has no derivative to lose";
  sim.set("k", 0.7);
  sim.gradient();
  sim.set("a", -0.5);  // the place where p is 0 moves
  expect_told("this divides by p, which has both signs where the run begins");
  sim.set_initial("p", std::vector<double>{1, 2, -1});  // each by itself: nothing moves them
  sim.gradient();
}

TEST_F(SignsOfHosts, GoOnByForceWithAWarning) {
  std::vector<Message> warnings;
  Simulation sim =
      compile_text(falling, {.name = "t", .set = {{"k", "2"}}, .force = true, .certify = false, .warnings = &warnings});
  sim.gradient();
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings.front().code, "W0609");
}

TEST_F(SignsOfHosts, AreLostInLibrariesToo) {
  const dpde_scene* scene = build(write("falling.dpde", falling), "t");
  ASSERT_NE(scene, nullptr);
  Simulation sim(*scene);
  sim.gradient();
  sim.set("k", 2);
  EXPECT_THROW(sim.gradient(), NoSolution);
}

}  // namespace
}  // namespace dpde::testing
