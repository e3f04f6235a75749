// SPDX-License-Identifier: Apache-2.0
// What a host may set, and what moves with it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "dpde/dpde.h"

namespace dpde {
namespace {

/// The formula of a field that is sought says where it begins; in derivatives by another unknown the field is fixed.
TEST(Settings, SoughtFieldsStayWhereOtherUnknownsMove) {
  const std::string text = R"(
model heat { field u; param k, q; dt(u) = k*lap(u) + q }
scheme ftcs { lap = central(2); time = euler }
scene scaled : heat with ftcs {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.3
  initial u = q*sin(x) + k
  time 0 .. 1, step 1/8
}
task level : scaled {
  unknown q from 0.5
  unknown initial u
  minimise mean((u - q)^2) at t = 0
}
)";
  Simulation sim = compile_text(text, {.name = "level"});
  EXPECT_NEAR(sim.gradient(), 0.165, 1e-15);  // q^2/2 + (k - q)^2
  EXPECT_NEAR(sim.gradient_of("q")[0], 0.4, 1e-14);
  const double e = 1e-6;
  sim.set("q", 0.5 + e);
  const double above = sim.loss();
  sim.set("q", 0.5 - e);
  EXPECT_NEAR((above - sim.loss()) / (2 * e), 0.4, 1e-9);
  sim.set("k", 0.25);  // which is not sought: the field begins anew, where q is now
  EXPECT_NEAR(sim.initial("u")[0] - 0.25, (0.5 - e) * std::sin(M_PI / 16), 1e-14);
}

/// What grid and times are made of cannot be set when they are.
TEST(Settings, FixedParametersAreRefused) {
  Simulation sim = compile_text(R"(
model m { field u; param L = 1, P = 0.1, a = 2, b; dt(u) = -a*u }
scene s : m {
  grid x = 0 .. L, cells 4, periodic
  b = 2*a
  initial u = b
  time 0 .. 1, step 0.1
  every P: u += 1
}
)");
  for (const char* name : {"L", "P"}) {
    try {
      sim.set(name, 0.5);
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      EXPECT_NE(std::string(error.what()).find("give its value there"), std::string::npos) << error.what();
    }
    sim.set(name, sim.param(name));
  }
  sim.set("a", 1);
  sim.set("b", 3);
}

}  // namespace
}  // namespace dpde
