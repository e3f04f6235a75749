// SPDX-License-Identifier: Apache-2.0
// What a host may set, and what moves with it.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <chrono>
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
  sim.set("k", 0.25);  // which is not sought: the field moves with it alone
  EXPECT_NEAR(sim.initial("u")[0] - 0.25, 0.5 * std::sin(M_PI / 16), 1e-14);
}

/// Whatever is set first: a sought field begins where unknowns were at first and all else is now.
TEST(Settings, OrderMakesNoDifference) {
  const auto made = [] {
    return compile_text(R"(
model m { field u, q; param a = 2, b = 1, c = 1; dt(u) = -u; dt(q) = -q }
scene s : m {
  grid x = 0 .. 1, cells 4, periodic
  time 0 .. 0.1, step 0.05
  initial u = a*b*(1 + x)
  initial q = a*c
}
task f : s { unknown a; unknown initial u; minimise mean((u + q)^2) at t = 0 }
)",
                        {.name = "f"});
  };
  const std::string names[] = {"a", "b", "c"};
  for (const int first : {0, 1, 2}) {
    for (const int step : {1, 2}) {
      Simulation sim = made();
      for (int i = 0; i < 3; ++i) {
        sim.set(names[(first + i * step) % 3], 3);
        sim.loss();
      }
      EXPECT_DOUBLE_EQ(sim.initial("u")[0], 2 * 3 * 1.125) << first << step;
      EXPECT_DOUBLE_EQ(sim.initial("q")[0], 9) << first << step;
      EXPECT_DOUBLE_EQ(sim.param("a"), 3);
      sim.set("b", 1);
      EXPECT_DOUBLE_EQ(sim.initial("u")[0], 2 * 1.125);
    }
  }
  Simulation sim = made();
  sim.set_initial("u", std::vector<double>(4, 7));
  sim.set("a", 3);
  sim.set("b", 3);
  EXPECT_EQ(sim.initial("u")[0], 7);
}

/// What grid and times are made of cannot be set when they are.
TEST(Settings, FixedParametersAreRefused) {
  Simulation sim = compile_text(R"(
model m {
  field u
  param L = 1, P = 0.1, a = 2, b, D[2] = (c, 1), c = 1, d = 1, g = 1, h = 1, s = 3, n = 3
  control F
  dt(u) = -a*u*b*D[1] + F + random_signal(seed = n, lowest = 1, highest = 2)
}
scene s : m {
  grid x = 0 .. L, cells 4, periodic
  b = 2*d
  F = g + h*t every 0.2
  initial u = b + random_field(seed = s, lowest = 1, highest = 2)
  time 0 .. 1, step 0.1
  every P: u += 1
}
)");
  for (const char* name : {"L", "P", "c", "d", "g", "h", "s", "n"}) {
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

/// Formulas that a coefficient's own is part of do not follow values that are given in its place: no run goes on with
/// half of them.
TEST(Settings, WhatIsMadeOfAGivenCoefficientIsGivenToo) {
  Simulation sim = compile_text(R"(
model m { field u in K; coefficient c, e; param a = 1; dt(u) = c - e*u }
scene s : m {
  grid x = 0 .. 1 in m, cells 4, periodic
  c = a*x
  e = 2*c
  initial u = c + 1
  time 0 .. 1, step 0.1
}
)");
  EXPECT_STREQ(sim.unit("u"), "K");
  EXPECT_STREQ(sim.unit("x"), "m");
  EXPECT_STREQ(sim.unit("c"), "");
  const std::vector<double> values(4, 3);
  const auto told = [&] {
    try {
      sim.reset();
      sim.run();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  sim.set("a", 2);
  EXPECT_EQ(told(), "");
  sim.set_field("c", values);
  EXPECT_NE(told().find("u is made of the formula of c"), std::string::npos) << told();
  sim.set_initial("u", values);
  EXPECT_NE(told().find("e is made of the formula of c"), std::string::npos) << told();
  sim.set_field("e", values);
  EXPECT_EQ(told(), "");
}

/// Scenes of programs are as those of models.
TEST(Settings, FixedParametersOfProgramsAreRefused) {
  Simulation sim = compile_text(R"(
kernel decay(u: field, out w: field, k: param) { w = u - 0.1*k*u }
program p { fill u periodic; run decay; swap u, w }
scene s : p { grid x = 0 .. q, cells 4, periodic; k = 1; let q = 2*k; initial u = 1 + x; time 0 .. 1, step 0.1 }
)");
  EXPECT_THROW(sim.set("k", 2), Error);
}

/// 1e9 steps to where it rests: the certificate that is made where it is cheap does not wait for them.
TEST(Settings, CertificatesOfSteadyStatesHaveABoundInTime) {
  const auto start = std::chrono::steady_clock::now();
  Simulation sim = compile_text(R"(model m { field u; param k; param f; dt(u) = k*(f - u) }
scheme c { time = euler }
scene s : m with c { k = 1e-7; f = 1; grid x = 0 .. 1, cells 16, periodic; initial u = x
  time 0 .. 1e8, step 0.1, until steady 1e-10 }
task t : s { unknown f from 0.5; minimise mean(u^2) }
)");
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 20);
  EXPECT_EQ(sim.unknowns(), std::vector<std::string>{"f"});
}

TEST(Settings, OrderOfValues) {
  Simulation sim = compile_text(R"(model still {
  field u
  dt(u) = 0*u
}
scene s : still {
  grid x = 0 .. 3, cells 3, periodic
  grid y = 0 .. 2, cells 2, periodic
  initial u = x + 10*y
  time 0 .. 1, step 1
}
)");
  sim.step();
  EXPECT_EQ(sim.state("u"), (std::vector<double>{5.5, 6.5, 7.5, 15.5, 16.5, 17.5}));
  Eigen::ArrayXXd columns(3, 2);
  sim.state("u", columns);
  EXPECT_EQ(columns(2, 1), 17.5);
}

/// Whole fields of places are given back behind the first formulas.
TEST(Settings, FormulasOfPlacesFollowParametersInEachStep) {
  const char* const text = R"(model m { field u; coefficient c; param k; dt(u) = c*lap(u) }
scene s : m { grid x = 0 .. 1, cells 8, periodic; grid y = 0 .. 1, cells 6; boundary u = 0; k = 0.5; c = k*(0.02 + 0.01*x)
  initial u = sin(2*pi*x) + y; observe middle = mean(x*u); time 0 .. 1, step 0.01 })";
  Simulation sim = compile_text(text, {.name = "s"});
  const auto step_with = [&](double k) {
    sim.set("k", k);
    sim.step();
  };
  for (const double k : {0.5, 0.6, 0.7, 0.8, 0.9}) step_with(k);
  Simulation other = compile_text(text, {.name = "s"});
  other.observe("middle");  // it reads x before
  for (const double k : {0.5, 0.6, 0.7, 0.8, 0.9}) {
    other.set("k", k);
    other.step();
    other.observe("middle");
  }
  EXPECT_EQ(sim.state("u"), other.state("u"));
  EXPECT_EQ(sim.observe("middle"), other.observe("middle"));
  EXPECT_EQ(sim.coordinates(0), other.coordinates(0));
}

}  // namespace
}  // namespace dpde
