// SPDX-License-Identifier: Apache-2.0
// Properties of a step in `dpde check` other than stability: orders with walls, cell numbers, positivity, waves.
#include <cmath>
#include <numbers>

#include "command_support.h"

namespace dpde::testing {
namespace {

using Character = Command;

std::string steep_burgers(const std::string& advect) {
  return "model m { field u; dt(u) = -advect(u, u) + 0.01/pi*lap(u) }\nscheme c { time = ssp_rk3; advect = " + advect +
         " }\nscene s : m with c {\n  grid x = -1 .. 1, cells 64, periodic\n  initial u = -sin(pi*x)\n"
         "  time 0 .. 1, step 1/128\n}\n";
}

/// Section 16 of the table of references: Burgers 4.A on 64 cells, |u|*h/nu = 9.81.
TEST_F(Character, CellReynoldsNumbersAboveTwoAreAWarningOfCentralDifferences) {
  write("s.dpde", steep_burgers("central(2)"));
  const Outcome central = dpde("check s.dpde --json");
  EXPECT_EQ(central.status, 0) << central.err;
  EXPECT_EQ(central.codes(), std::vector<std::string>{"W0804"}) << central.err;
  const Json found = central.json();
  ASSERT_EQ(found["cell_numbers"].size(), 1u);
  EXPECT_EQ(found["cell_numbers"][0]["kind"], "reynolds");
  EXPECT_NEAR(found["cell_numbers"][0]["number"].get<double>(), 9.806, 1e-3);
  EXPECT_EQ(found["cell_numbers"][0]["rings"], true);
  EXPECT_EQ(found["monotone"]["kept"], false);
  EXPECT_EQ(found["monotone"]["max_step"], 0);
  const Outcome series = dpde("check s.dpde --all --set advect=spectral --set dx=spectral");
  EXPECT_NE(series.err.find("above 2 Fourier series of advection oscillate"), std::string::npos) << series.err;
  EXPECT_TRUE(dpde("check s.dpde --json --set advect=upwind1").codes().empty());
  EXPECT_TRUE(dpde("check s.dpde --json --set advect=upwind3").codes().empty());
  EXPECT_TRUE(dpde("check s.dpde --json --set cells.x=317").codes().empty()) << "what the hint says";
}

/// u and v are mirror images. With a solve, waves are analysed at few points, but cell numbers at all.
TEST_F(Character, CellNumbersOfConstrainedFlowAreTheLargest) {
  write("s.dpde",
        "model m { vector u on faces; field p; dt(u) = -advect(u, u) - grad(p) + 0.02*lap(u); 0 = div(u) gives p }\n"
        "scene s : m {\n  grid x = 0 .. 2*pi, cells 24, periodic\n  grid y = 0 .. 2*pi, cells 24, periodic\n"
        "  initial u = (sin(x)*cos(y), -cos(x)*sin(y))\n  time 0 .. 1, step 0.02\n}\n");
  const Outcome check = dpde("check s.dpde --json");
  EXPECT_EQ(check.status, 0) << check.err;
  const Json found = check.json()["cell_numbers"];
  ASSERT_EQ(found.size(), 4u) << found.dump();
  for (const Json& number : found)  // the faces nearest to |u| = 1 lie 6 cells from 0, centres half a cell off
    EXPECT_NEAR(number["number"].get<double>(), std::cos(std::numbers::pi / 24) * 2 * std::numbers::pi / 24 / 0.02,
                1e-2)
        << number.dump();
}

/// Section 1: theta = pi/4, a Courant number of 0.5.
TEST_F(Character, WavesAreDampedAndDelayed) {
  write("s.dpde",
        "model m { field u; dt(u) = -advect(1, u) }\nscheme c { time = euler; advect = upwind(1) }\nscene s : m with c "
        "{\n"
        "  grid x = 0 .. 32, cells 32, periodic\n  initial u = sin(2*pi*x/32)\n  time 0 .. 10, step 0.5\n}\n");
  const Outcome check = dpde("check s.dpde --waves --json");
  EXPECT_EQ(check.status, 0) << check.err;
  const Json json = check.json();
  ASSERT_EQ(json["waves"].size(), 4u);
  EXPECT_EQ(json["waves"][1]["cells"], 8);
  EXPECT_NEAR(json["waves"][1]["growth_per_step"].get<double>(), 0.9238795325, 1e-10);
  EXPECT_NEAR(json["waves"][1]["growth_per_time"].get<double>(), 0.9238795325 * 0.9238795325, 1e-9);
  EXPECT_NEAR(json["waves"][1]["phase_speed"].get<double>(), 1, 1e-9);
  EXPECT_EQ(json["monotone"]["kept"], true);
  EXPECT_NEAR(json["monotone"]["max_step"].get<double>(), 1, 1e-6);
  EXPECT_FALSE(dpde("check s.dpde --json").json().contains("waves"));
}

/// The largest eigenvalue of 1 + 0.8*h^2*lap is 1 - 4*0.8, modulus 2.2: no step is short enough.
TEST_F(Character, WhatEventsLetGrowIsTold) {
  write("s.dpde",
        "model m { field u; param c = 0.8; dt(u) = 0.01*lap(u) }\nscene s : m {\n"
        "  grid x = 0 .. 1, cells 16, periodic\n"
        "  initial u = sin(2*pi*x)\n  after step: u += c/16^2*lap(u)\n  time 0 .. 1, step 0.01\n}\n");
  EXPECT_NEAR(dpde("check s.dpde --json").json()["stability"]["growth_by_events"].get<double>(), std::log(2.2), 1e-6);
  EXPECT_NE(dpde("check s.dpde --all").out.find("what ends each step multiplies waves by up to 2.2"),
            std::string::npos);
  const Outcome calm = dpde("check s.dpde --all --set c=0.3");
  EXPECT_EQ(calm.out.find("what ends each step"), std::string::npos) << calm.out;
}

/// Verdicts and sums refer to steps without these events.
TEST_F(Character, EventsOfSomeStepsAreLeftOutAndThatIsTold) {
  write("s.dpde",
        "model m { field u; dt(u) = 0.1*lap(u) }\nscene s : m { grid x = 0 .. 1, cells 16, periodic; initial u = 1\n"
        "  time 0 .. 1, step 1/4000; every 0.01: u = -3*u }\n");
  const Outcome check = dpde("check s.dpde --all");
  EXPECT_NE(check.out.find("  events that only some steps have are not in it\n"), std::string::npos) << check.out;
  EXPECT_NE(check.out.find("conserved but for events: integral(u)"), std::string::npos) << check.out;
  EXPECT_EQ(dpde("check s.dpde --json").json()["conserved_between_events"], true);
}

/// The guess is stored in addition to the states and has no equation.
TEST_F(Character, GrowthBesideACarriedGuessIsTold) {
  write("s.dpde",
        "model m { field u; param k = 3, r = 3; solve lap(psi) - k*psi = -u for psi\n  dt(u) = psi + r*u }\n"
        "scheme w { time = rk4; solve = cg }\nscene s : m with w { grid x = 0 .. 1, cells 8; boundary psi: all = 0\n"
        "  boundary u: all = zero_gradient; initial u = 1; time 0 .. 0.1, step 1/400 }\n");
  const Outcome check = dpde("check s.dpde --all");
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_NE(check.out.find("the equations themselves let waves grow"), std::string::npos) << check.out;
}

/// Ordinary differential equations: rk4's stability interval over the fastest rate, states over time.
TEST_F(Character, ScenesWithoutAGridAreOneCell) {
  write("s.dpde",
        "model m { field a, b; param k = 9.5; dt(a) = -k*a; dt(b) = a }\nscene s : m {\n  initial a = 1\n  initial b = "
        "1\n"
        "  time 0 .. 2, step 0.01\n}\n");
  const Outcome check = dpde("check s.dpde --all");
  EXPECT_NE(check.out.find("beyond it a disturbance grows first, by -k*a"), std::string::npos) << check.out;
  EXPECT_NEAR(dpde("check s.dpde --json").json()["stability"]["max_step"].get<double>(), 2.785294 / 9.5, 1e-4);
  const Outcome run = dpde("run s.dpde --out out");
  EXPECT_NE(run.out.find(" t "), std::string::npos) << run.out;
  EXPECT_EQ(run.out.find(" x "), std::string::npos) << run.out;
}

std::string heated_rod(const std::string& rate, const std::string& boundary, const std::string& k = "1 + x^2") {
  return "model m { field u; coefficient k; dt(u) = " + rate + " }\nscheme c { lap = central(4); dx = central(4) }\n" +
         "scene s : m with c {\n  grid x = 0 .. 1, cells 32\n  k = " + k + "\n  boundary u: " + boundary +
         "\n  initial u = x\n  time 0 .. 1/64, step 1/16384\n}\n";
}

/// Orders measured by WallFlux of tests/numeric.
TEST_F(Character, OrdersHoldWallsToo) {
  const auto order = [&](const std::string& text) {
    write("s.dpde", text);
    const Outcome check = dpde("check s.dpde --json");
    EXPECT_EQ(check.status, 0) << check.err;
    return check.json()["order"];
  };
  Json found = order(heated_rod("k*lap(u)", "x.low = 1, x.high = zero_gradient"));
  EXPECT_EQ(found["space"], 2);
  EXPECT_EQ(found["space_inside"], 4);
  EXPECT_TRUE(found["walls"].is_null());
  EXPECT_EQ(order(heated_rod("div(k*grad(u))", "x = gradient(1)"))["space"], 2);
  EXPECT_EQ(order(heated_rod("div(k*grad(u))", "x = gradient(k)"))["space"], 2);
  EXPECT_EQ(order(heated_rod("div(k*grad(u))", "x = 0"))["space"], 2);
  found = order(heated_rod("lap(u) + dx(k)", "x = 0"));
  EXPECT_EQ(found["space"], 1) << "a slope that is half of what it should be";
  EXPECT_EQ(found["walls"], "k is mirrored beyond x.low");
}

/// From 1 to 4 in the last two cells: -0.5 by extrapolation to the wall.
TEST_F(Character, CoefficientsThatChangeTheirSignOnAWallAreAWarning) {
  write("s.dpde", heated_rod("div(k*grad(u))", "x.low = 0, x.high = mixed(1, 1, 0)", "if(x > 1 - 1/32, 1, 4)"));
  const Outcome run = dpde("run s.dpde --json");
  const std::vector<std::string> codes = run.codes();
  EXPECT_NE(std::ranges::find(codes, "W0504"), codes.end()) << run.err;
  EXPECT_NE(run.err.find("k is extrapolated to -0.5 on the wall x.high"), std::string::npos) << run.err;
  write("smooth.dpde", heated_rod("div(k*grad(u))", "x.low = 0, x.high = mixed(1, 1, 0)"));
  EXPECT_TRUE(dpde("run smooth.dpde --json").codes().empty());
}

/// One real transform and its inverse on 64 cells, 5 n log2(n) each; one multiplier for 33 waves.
TEST_F(Character, TransformsAndSolvesAreCounted) {
  const auto checked = [&](const std::string& scheme) {
    write("s.dpde", "model m { field u; dt(u) = lap(u) }\nscheme c { " + scheme +
                        " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 64, periodic\n  initial u = sin(2*pi*x)\n"
                        "  time 0 .. 1e-3, step 1e-5\n}\n");
    return dpde("check s.dpde --json").json();
  };
  const Json series = checked("lap = spectral; time = euler");
  EXPECT_EQ(series["transforms"]["bytes"], 16 * 33 * 3);
  EXPECT_EQ(series["transforms"]["flops_per_step"], 2 * 5 * 64 * 6 + 8 * 33);
  EXPECT_EQ(series["transforms"]["estimate"], false);
  EXPECT_TRUE(series["solves"].is_null());
  EXPECT_GE(series["memory_bytes"].get<double>(), checked("time = euler")["memory_bytes"].get<double>());
  const Json implicit = checked("time = backward_euler");
  EXPECT_EQ(implicit["solves"]["estimate"], true);
  EXPECT_GT(implicit["solves"]["flops_per_step"].get<double>(), 64);
  EXPECT_TRUE(implicit["transforms"].is_null());
}

/// The order of a method holds for equal steps: with a tolerance errors follow the tolerance.
TEST_F(Character, SaysThatAToleranceChoosesTheSteps) {
  const auto checked = [&](const std::string& steps) {
    write("s.dpde", "model m { field u; dt(u) = -u }\nscheme c { time = dopri5 }\nscene s : m with c {\n" +
                        std::string("  grid x = 0 .. 1, cells 4, periodic\n  initial u = 1\n  time 0 .. 1, step 1/4") +
                        steps + "\n}\n");
    return dpde("check s.dpde --json").json()["order"];
  };
  EXPECT_EQ(checked("")["steps"], "equal");
  EXPECT_EQ(checked(", tolerance 1e-6")["steps"], "tolerance");
  EXPECT_EQ(checked(", tolerance 1e-6")["time"], 5);
  EXPECT_NE(dpde("check s.dpde --all").out.find("5 in time for equal steps (here the tolerance chooses them"),
            std::string::npos);
}

}  // namespace
}  // namespace dpde::testing
