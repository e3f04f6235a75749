// SPDX-License-Identifier: Apache-2.0
// Data sets of formulas as users have them: frames of curl(u), and their comparison in tasks.
#include <string>
#include <utility>
#include <vector>

#include "command_support.h"

namespace dpde::testing {
namespace {

const std::string flow = R"(
model flow { vector u on faces; field c; param nu = 0.01; let slope = grad(c)
  dt(u) = nu*lap(u); dt(c) = -advect(u, c) + nu*lap(c) }
scene fine : flow { grid x = 0 .. 1, cells 16, periodic; grid y = 0 .. 1, cells 16, periodic
  initial u = (sin(2*pi*y), sin(4*pi*x)); initial c = cos(2*pi*x)*sin(2*pi*y); time 0 .. 1/4, step 1/64 }
dataset d : fine { frames of u, c, omega = curl(u), q = c^2, flux = u*interpolate(c), pair = (c, 2*c), slope every 1/16
  file "d.nc" }
)";

class FormulaFrames : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("d.dpde", flow);
    const Outcome made = dpde("run d.dpde d --out . --json");
    ASSERT_EQ(made.status, 0) << made.out << made.err;
    for (const char* name : {"u.x", "c", "omega", "q", "flux.y", "pair.x", "slope.x"})
      EXPECT_TRUE(made.json()["estimates"].contains(name)) << name << made.out;
    EXPECT_TRUE(made.json()["residuals"].contains("u.x"));
    EXPECT_FALSE(made.json()["residuals"].contains("omega"));
  }
  /// Each datum with its counterpart: a loss, and a separate test.
  Outcome learn(const std::vector<std::pair<std::string, std::string>>& compared) const {
    std::string text = flow + "task t : fine {\n  unknown nu from 0.02 in 0 .. 1; using lbfgs(), epochs 40\n";
    for (std::size_t i = 0; i < compared.size(); ++i) {
      const auto& [data, misfit] = compared[i];
      text += "  " + data + "\n  minimise mean(" + misfit + ") over 4 steps\n  test e" + std::to_string(i) +
              " = mean(" + misfit + ") on trajectories(\"d.nc\") for 16 steps\n";
    }
    write("t.dpde", text + "}\n");
    return dpde("optimize t.dpde t --json");
  }
};

/// The misfit to frames of a formula is 0 at the viscosity of the data, for every placement of the formula.
TEST_F(FormulaFrames, LossesAndTestsAreCompared) {
  const Outcome learnt =
      learn({{"data w on nodes = trajectories(\"d.nc\", omega)", "(curl(u) - w)^2"},
             {"data r = trajectories(\"d.nc\", q)", "(c^2 - r)^2"},
             {"data f on faces = trajectories(\"d.nc\", flux)", "dot(u*interpolate(c) - f, u*interpolate(c) - f)"},
             {"data p = trajectories(\"d.nc\", (pair.x, pair.y))", "dot((c, 2*c) - p, (c, 2*c) - p)"},
             {"data g on faces.x = trajectories(\"d.nc\", slope.x)", "(grad(c).x - g)^2"},
             {"data k on faces = trajectories(\"d.nc\", slope)", "dot(slope - k, slope - k)"}});
  ASSERT_EQ(learnt.status, 0) << learnt.out << learnt.err;
  EXPECT_NEAR(learnt.json()["unknowns"]["nu"]["value"].get<double>(), 0.01, 1e-6);
  for (int i = 0; i < 6; ++i) {
    const Json test = learnt.json()["test"]["e" + std::to_string(i)];
    EXPECT_LT(test["mean"].get<double>(), 1e-9) << i;
    EXPECT_GT(test["start"]["mean"].get<double>(), 1e-6) << i;
  }
}

TEST_F(FormulaFrames, WhatLiesElsewhereIsSaid) {
  const Outcome outcome = learn({{"data r = trajectories(\"d.nc\", slope.x)", "(c - r)^2"}});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.out.find("slope.x lies on faces along x there and at centres here"), std::string::npos)
      << outcome.out;
  const Outcome half = learn({{"data r = trajectories(\"d.nc\", (slope.x, 2))", "dot(r, r)"}});
  EXPECT_NE(half.out.find("of a vector the components"), std::string::npos) << half.out;
}

/// A Fourier derivative has the placement of its field. It was taken as one on faces, half a cell off, and
/// interpolating such expressions between cells was an internal error.
TEST_F(FormulaFrames, OfWavesLieAtTheCentres) {
  const std::string waves =
      "model m { field c; dt(c) = 0*lap(c) }\nscheme f { dx = spectral; lap = spectral; time = rk4 }\n"
      "scene s : m with f { grid x = 0 .. 2*pi, cells 16, periodic; initial c = sin(x); time 0 .. 0.1, step 0.1\n"
      "  observe far = max(abs(interpolate(dx(c)) - cos(x))) }\n";
  write("w.dpde", waves);
  EXPECT_LT(dpde("run w.dpde s --json").json()["observables"]["far"].get<double>(), 1e-14);
  for (const char* formula : {"dx(c)", "interpolate(dx(c))", "interpolate(c)"}) {
    write("f.dpde", waves + "dataset d : s { frames of e on faces.x = " + formula + " every 0.1; file \"d.nc\" }\n");
    const Outcome refused = dpde("run f.dpde d --out . --json");
    EXPECT_EQ(refused.codes(), std::vector<std::string>{"E0331"}) << formula << refused.err;
  }
}

}  // namespace
}  // namespace dpde::testing
