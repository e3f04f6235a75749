// SPDX-License-Identifier: Apache-2.0
// Numbers below the smallest normal one are 0 while programs run, the same on every back end; hosts keep their own
// mode.
#include "dpde/runtime/float_mode.h"

#include <cmath>
#include <limits>

#include "host_support.h"

namespace dpde::testing {
namespace {

/// u halves in each step, exactly: 1, 1/2, ... by powers of two down to the smallest normal number.
const char* halving = R"(model halving { field u; param k; dt(u) = -k*u }
scheme s { time = euler }
scene fall : halving with s {
  grid x = 0 .. 1, cells 16, periodic
  k = 0.5
  initial u = 1
  time 0 .. 1100, step 1
}
task find : fall { unknown k from 0.5; minimise mean(u^2) at t = 1100 }
)";

bool keeps_subnormals() {
  volatile double smallest = std::numeric_limits<double>::min();
  volatile double half = smallest / 2;
  return half != 0;
}

TEST(FloatMode, NoBackEndMakesSubnormalStates) {
  if (mode_without_subnormals() == float_mode()) GTEST_SKIP() << "this processor's mode cannot be set";
  for (const auto& [real, smallest] : {std::pair{"f64", -std::numeric_limits<double>::min_exponent + 1},
                                       {"f32", -std::numeric_limits<float>::min_exponent + 1}}) {
    for (const HostBackend backend : {HostBackend::jit, HostBackend::cpp, HostBackend::interpreter}) {
      Simulation sim = compile_text(halving, {.name = "fall", .set = {{"real", real}}, .backend = backend});
      sim.step(smallest);
      EXPECT_EQ(sim.state("u")[3], std::ldexp(1.0, -smallest)) << real;
      sim.step();  // u - u/2: half of it is 0 where the product is rounded before the difference
      EXPECT_TRUE(sim.state("u")[3] == 0 || sim.state("u")[3] == std::ldexp(1.0, -smallest))
          << real << " " << sim.state("u")[3];
    }
  }
}

TEST(FloatMode, HostsKeepTheirOwn) {
  const FloatMode before = float_mode();
  Simulation sim = compile_text(halving, {.name = "find", .threads = 2});
  const auto expect_own = [&](const char* when) {
    EXPECT_EQ(float_mode(), before) << when;
    EXPECT_TRUE(keeps_subnormals()) << when;
  };
  expect_own("after compilation");
  sim.step();
  expect_own("after a step");
  sim.run_to(
      20,
      [&](const Progress&) {
        expect_own("while it runs");
        return true;
      },
      4);
  sim.loss();
  expect_own("after a loss");
  sim.watch_gradients(
      [&](const GradientProgress&) {
        expect_own("while a gradient is computed");
        return true;
      },
      100);
  sim.gradient();
  expect_own("after a gradient");
  sim.set("k", 1e300);
  EXPECT_THROW(sim.run(), Error);
  expect_own("after an error");
}

/// A host that works without them finds that mode again.
TEST(FloatMode, AHostWithoutThemKeepsThatToo) {
  if (mode_without_subnormals() == float_mode()) GTEST_SKIP() << "this processor's mode cannot be set";
  const FloatScope scope;
  const FloatMode own = float_mode();
  Simulation sim = compile_text(halving, {.name = "find"});
  sim.gradient();
  EXPECT_EQ(float_mode(), own);
  EXPECT_FALSE(keeps_subnormals());
}

}  // namespace
}  // namespace dpde::testing
