// SPDX-License-Identifier: Apache-2.0
// Causes named by `dpde check`: ill-posed equations, downwind differences, coefficients that jump within a flux.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class Causes : public Command {
 protected:
  Outcome checked(const std::string& text) {
    write("s.dpde", text);
    return dpde("check s.dpde --json");
  }
  bool tells(const std::string& text, const std::string& code) { return told(checked(text), code); }
  static bool told(const Outcome& outcome, const std::string& code) {
    const std::vector<std::string> codes = outcome.codes();
    return std::ranges::find(codes, code) != codes.end();
  }
};

std::string ring(const std::string& model, const std::string& scheme, const std::string& scene) {
  return "model m { " + model + " }\nscheme q { " + scheme + " }\nscene s : m with q {\n" +
         "  grid x = 0 .. 1, cells 32, periodic\n  " + scene + "\n  time 0 .. 1e-3, step 1e-5\n}\n";
}

/// Unbounded growth for each power, and bounded growth; also with coefficients and states.
TEST_F(Causes, IllPosedEquationsAreTold) {
  struct Case {
    std::string model, scene;
    int order;  // 0: well-posed
  };
  const std::string u = "initial u = sin(2*pi*x)", both = u + "\n  initial v = cos(2*pi*x)";
  for (const Case& c :
       std::vector<Case>{{"field u; param k = -0.1; dt(u) = k*lap(u)", u, 2},
                         {"field u; dt(u) = 1e-3*lap(lap(u))", u, 4},
                         {"field u; dt(u) = -lap(u) - 1e-3*lap(lap(u))", u, 0},
                         {"field u, v; dt(u) = lap(v); dt(v) = lap(u)", both, 2},
                         {"field u, v; dt(u) = lap(v); dt(v) = -lap(u)", both, 0},
                         {"field u, v; dt(u) = dx(v); dt(v) = -dx(u)", both, 1},
                         {"field u, v; dt(u) = dx(v); dt(v) = dx(u)", both, 0},
                         {"field u; dt(dt(u)) = -lap(u)", u + "\n  initial dt(u) = 0", 1},
                         {"field u; coefficient k; dt(u) = div(k*grad(u))", u + "\n  k = 0.1 + sin(2*pi*x)", 2},
                         {"field u; coefficient k; dt(u) = div(k*grad(u))", u + "\n  k = 1.1 + sin(2*pi*x)", 0},
                         {"field u; dt(u) = div((u^2 - 0.5)*grad(u))", u, 2},
                         {"field u; dt(u) = -advect(u, u) + 20*u", u, 0},
                         {"field u; dt(u) = lap(u^3 - u - 1e-2*lap(u))", u, 0}}) {
    const Outcome check = checked(ring(c.model, "time = rk4", c.scene));
    EXPECT_EQ(told(check, "W0819"), c.order > 0) << c.model;
    const Json found = check.json()["stability"]["ill_posed"];
    EXPECT_EQ(found.is_null() ? 0 : found["order"].get<int>(), c.order) << c.model;
  }
}

TEST_F(Causes, ARunThatHasGrownNamesIllPosedEquations) {
  write("s.dpde", ring("field u; dt(u) = -20*lap(u)", "time = rk4", "initial u = sin(2*pi*x) + 1e-6*noise(1)"));
  const Outcome run = dpde("run s.dpde");
  EXPECT_NE(run.err.find("ill-posed: growth of the shortest waves rises as 1/h^2"), std::string::npos) << run.err;
}

/// The sign of the velocity decides, whatever its formula, not the way the term is written.
TEST_F(Causes, DifferencesThatLookDownwindAreTold) {
  for (const std::string scheme : {"advect = upwind(1); time = euler", "advect = upwind(3); time = rk4"}) {
    for (const auto& [equation, is_downwind] : {std::pair{"advect(-1, u)", true},
                                                {"-advect(1, u)", false},
                                                {"c*advect(1, u)", false},
                                                {"-c*advect(1, u)", true},
                                                {"advect(c*sin(2*pi*x), u)", true}}) {
      const std::string model = std::string("field u; param c = -1; dt(u) = ") + equation;
      EXPECT_EQ(tells(ring(model, scheme, "initial u = sin(2*pi*x)"), "W0510"), is_downwind) << equation << scheme;
    }
  }
  for (const std::string scheme : {"advect = central(2); time = rk4", "advect = spectral; lap = spectral; time = rk4",
                                   "dx = spectral; lap = spectral; advect = upwind(3); time = rk4"}) {
    EXPECT_FALSE(tells(ring("field u; dt(u) = -advect(1, u) + 0.1*lap(u)", scheme, "initial u = sin(2*pi*x)"), "W0510"))
        << scheme;
  }
}

TEST_F(Causes, JumpsInFluxesLowerTheOrder) {
  struct Case {
    std::string rate, k;
    bool jumps;
  };
  for (const Case& c : std::vector<Case>{{"div(k*grad(u))", "if(x < 0.5, 1, 10)", true},
                                         {"div(k*grad(u))", "2 + sign(x - 0.5)", true},
                                         {"div(k*grad(u))", "1 + floor(4*x)", true},
                                         {"div(k*grad(u))", "1 + if(x < 0.5, 0, 1e-3)", true},
                                         {"div((1 + if(x < 0.5, 0, 1e-3) + 0*k)*grad(u))", "1", true},
                                         {"div(k*grad(u))", "1 + if(x < 0.5, 0, 1e-9)", false},
                                         {"div((1 + if(x < 0.5, 0, 1e-9) + 0*k)*grad(u))", "1", false},
                                         {"div(k*grad(u))", "if(x < 0.5, x + 1, 2 - x)", false},
                                         {"div(k*grad(u))", "2 + sin(2*pi*x)", false},
                                         {"div(grad(u)/interpolate(1/k))", "if(x < 0.5, 1, 10)", false},
                                         {"div(grad(u)/interpolate(1/k))", "if(x < 0.51, 1, 10)", true},
                                         {"div(grad(u)/interpolate(1/(k + 1)))", "if(x < 0.51, 1, 10)", true},
                                         {"div(grad(u)/interpolate(1/(if(x < 0.51, 1, 9)*k)))", "1", true},
                                         {"div(grad(u)/interpolate(1/k))", "1 + 9/(1 + exp(-20*(x - 0.51)))", false},
                                         {"k*lap(u)", "if(x < 0.5, 1, 10)", false},
                                         {"lap(u) + k", "if(x < 0.5, 1, 10)", false}}) {
    const std::string text =
        ring("field u; coefficient k; dt(u) = " + c.rate, "time = rk4", "initial u = sin(2*pi*x)\n  k = " + c.k);
    const Outcome check = checked(text);
    EXPECT_EQ(told(check, "W0509"), c.jumps) << c.rate << " " << c.k;
    const Json order = check.json()["order"];
    EXPECT_EQ(order["space"], c.jumps ? 1 : 2) << c.rate << " " << c.k;
  }
}

/// For masks, moving masks, states and operators; not where the branches meet, nor where the flux is 0 at the switch.
TEST_F(Causes, JumpsOfStatesAndMasksLowerTheOrder) {
  struct Case {
    std::string flux, names;
  };
  for (const Case& c : std::vector<Case>{{"(1 + 9*still)*grad(u)", "still"},
                                         {"(1 + 9*moving)*grad(u)", "moving"},
                                         {"if(u > 0.5, 1, 10)*grad(u)", "if(...)"},
                                         {"(2 + sign(u))*grad(u)", "sign(...)"},
                                         {"(2 + fraction(u))*grad(u)", "fraction(...)"},
                                         {"if(x < 0.5, 1 + x, 2 + x)*grad(u)", "if(...)"},
                                         {"grad(u)/interpolate(1/(1 + 9*moving))", ""},
                                         {"grad(u)/interpolate(1/if(u > 0.5, 1, 10))", ""},
                                         {"if(u > 0.5, 1, u + 0.5)*grad(u)", ""},
                                         {"max(u, 0.1)*grad(u)", ""},
                                         {"u*if(u > 0, 1, 2)*grad(u)", ""},
                                         {"if(dx(u) > 0, 1, 2)*grad(u)", ""},
                                         {"if(t < 0.5, 1, 2)*grad(u)", ""}}) {
    const Outcome check = checked(ring("field u; mask still, moving; dt(u) = div(" + c.flux + ")", "time = rk4",
                                       "initial u = sin(2*pi*x)\n  still = x < 0.5\n  moving = x < 0.3 + t"));
    const Json order = check.json()["order"];
    EXPECT_EQ(order["jumps"], c.names.empty() ? Json::array() : Json::array({c.names})) << c.flux;
    EXPECT_EQ(order["space"], c.names.empty() ? 2 : 1) << c.flux;
    EXPECT_EQ(told(check, "W0509"), !c.names.empty()) << c.flux;
  }
}

/// 1/w of a mask is 1/0: the hint takes the inverse of the whole factor of the gradient.
TEST_F(Causes, HintsOfJumpsNameWhatHasAnInverse) {
  const auto hint = [&](const std::string& declared, const std::string& flux) {
    write("s.dpde",
          ring("field u; " + declared + " w; dt(u) = div(" + flux + ")", "time = rk4",
               "initial u = sin(2*pi*x)\n  w = " + std::string(declared == "mask" ? "x < 0.5" : "if(x < 0.5, 1, 9)")));
    return dpde("check s.dpde --all").err;
  };
  const std::string of_all = "grad(u)/interpolate(1/k) in place of k*grad(u)";
  for (const char* flux : {"(1 + 9*w)*grad(u)", "w*grad(u)"})
    EXPECT_NE(hint("mask", flux).find(of_all), std::string::npos) << flux;
  EXPECT_NE(hint("coefficient", "(1 + 9*w)*grad(u)").find(of_all), std::string::npos);
  EXPECT_NE(hint("coefficient", "0.5*w*grad(u)").find("grad(u)/interpolate(1/w) in place of w*grad(u)"),
            std::string::npos);
}

/// Formulas that the compiler adds next to a pole are no jumps of a coefficient.
TEST_F(Causes, CurlsBesidePolesDoNotJump) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  EXPECT_FALSE(
      tells("model m { vector u on faces; dt(u) = -0.1*curl(curl(u)) }\nscene s : m {\n  coordinates polar\n"
            "  grid r = 0 .. 1, cells 8\n  grid theta = 0 .. 2*pi, cells 8, periodic\n"
            "  boundary u.x: r.low = 0, r.high = 0\n  boundary u.y: r.low = pole, r.high = 0\n"
            "  initial u = (0, 0)\n  time 0 .. 1e-3, step 1e-4\n}\n",
            "W0509"));
}

/// All formulas that change states count, also in events and fixed values. Observables do not count.
TEST_F(Causes, TheOrderIsOfAllThatStepsCompute) {
  const auto space = [&](const std::string& model, const std::string& scene) {
    return checked(ring(model, "lap = central(4); dx = central(2); time = rk4", "initial u = sin(2*pi*x)\n  " + scene))
        .json()["order"]["space"];
  };
  EXPECT_EQ(space("field u; dt(u) = lap(u)", ""), 4);
  EXPECT_EQ(space("field u; dt(u) = lap(u)", "after step: u = u - 1e-6*dx(u)"), 2);
  EXPECT_EQ(space("field u, v; mask w; dt(u) = lap(u); dt(v) = 0; v = dx(u) inside w", "w = x < 0.5\n  initial v = 0"),
            2);
  EXPECT_EQ(space("field u; dt(u) = lap(u)", "observe e = mean(dx(u)^2)"), 4);
}

/// Both forms are equal for div(u) = 0; with upwind differences they are different methods.
TEST_F(Causes, VelocitiesOnFacesHaveAFluxForm) {
  const auto forms = [&](const std::string& advection, const std::string& scheme, const std::string& constraint) {
    const Outcome check =
        checked("model m {\n  vector u on faces\n  field p\n  dt(u) = " + advection + " - grad(p) + 0.1*lap(u)\n  " +
                constraint + "\n}\nscheme q { " + scheme +
                " }\nscene s : m with q {\n  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 1, "
                "cells 8, periodic\n  initial u = (0, 0)\n  initial p = 0\n  time 0 .. 0.1, step 0.01\n}\n");
    return check.json()["advective_form"];
  };
  const std::string bound = "0 = div(u) gives p";
  EXPECT_EQ(forms("-advect(u, u)", "time = rk2", bound), Json::array({"u"}));
  EXPECT_EQ(forms("-div(outer(interpolate(u), interpolate(u)))", "time = rk2", bound), Json::array());
  EXPECT_EQ(forms("-advect(u, u)", "time = rk2; advect = upwind(3)", bound), Json::array());
  EXPECT_EQ(forms("-advect(u, u)", "time = rk2", "dt(p) = -div(u)"), Json::array());
}

/// Separate fields on faces, without a vector, have no outer product.
TEST_F(Causes, NumbersOnFacesHaveNoFluxForm) {
  const Outcome check = checked(
      "model m {\n  field u on faces.x\n  field v on faces.y\n  field p\n  dt(u) = -advect((u, v), u) - dx(p)\n"
      "  dt(v) = -advect((u, v), v) - dy(p)\n  0 = dx(u) + dy(v) gives p\n}\nscheme q { time = rk2 }\n"
      "scene s : m with q {\n  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 1, cells 8, periodic\n"
      "  initial u = 0\n  initial v = 0\n  initial p = 0\n  time 0 .. 0.1, step 0.01\n}\n");
  EXPECT_EQ(check.json()["advective_form"], Json::array()) << check.err;
}

/// The cause for which a gradient is refused, together with all other messages of check.
TEST_F(Causes, ChecksOfTasksThatJumpSayAllElse) {
  write("jump.dpde",
        "model m { field u; param k = 1; dt(u) = -k*if(u > 0.5, 1, 0.2) }\n"
        "scene s : m { initial u = 1; time 0 .. 1, step 0.1 }\n"
        "task t : s { unknown k; minimise u }\n");
  const auto expect_all_else = [&](const Outcome& check) {
    const Json json = check.json();
    for (const char* key : {"order", "stability", "cost", "memory_bytes", "gradient_memory_bytes"})
      EXPECT_TRUE(json.contains(key)) << key;
  };
  const Outcome later = dpde("check jump.dpde t --json");  // no switch where u is 1: found by a run
  EXPECT_EQ(later.status, 0);
  EXPECT_EQ(later.codes(), std::vector<std::string>{"W0609"});
  expect_all_else(later);
  write("floor.dpde",
        "model m { field u; param k = 1; dt(u) = -k*fraction(2*u) }\n"
        "scene s : m { initial u = 1.2; time 0 .. 1, step 0.1 }\n"
        "task t : s { unknown k; minimise u }\n");
  const Outcome now = dpde("check floor.dpde t --json");
  EXPECT_EQ(now.status, 2);
  EXPECT_EQ(now.codes(), std::vector<std::string>{"E0609"});
  expect_all_else(now);
}

TEST_F(Causes, JumpsInFluxesLeaveSpectralDerivativesOrderOne) {
  const auto order_with = [&](const std::string& k) {
    return checked(ring("field u; coefficient k; dt(u) = div(k*grad(u))", "dx = spectral; lap = spectral; time = rk4",
                        "initial u = sin(2*pi*x)\n  k = " + k))
        .json()["order"];
  };
  const Json jumping = order_with("if(x < 0.5, 1, 10)"), smooth = order_with("2 + sin(2*pi*x)");
  EXPECT_EQ(jumping["space"], 1);
  EXPECT_EQ(jumping["space_inside"], "inf");
  EXPECT_EQ(smooth["space"], "inf");
}

/// The suggested formula: the steady flux through a slab of two parts, with coefficients 1 and 1000, is 1/(a/1 + (1 -
/// a)/1000), exact on any grid with a face between them. If the interface is inside a cell, the error is that of its
/// position, up to half a cell: of order 1, and reported.
TEST_F(Causes, HarmonicMeansAreExactBetweenCells) {
  const auto error = [&](int cells, double a) {
    write("s.dpde", fmt::format("model m {{ field u; coefficient k; dt(u) = div(grad(u)/interpolate(1/k)) }}\n"
                                "scheme q {{ time = backward_euler }}\nscene s : m with q {{\n"
                                "  grid x = 0 .. 1, cells {}\n  k = if(x < {}, 1, 1000)\n"
                                "  boundary u: x.low = 1, x.high = 0\n  initial u = 1 - x\n  time 0 .. 100, step 1\n"
                                "  observe flux = mean(-k*dx(u), at = x.low)\n}}\n",
                                cells, a));
    const Json found = dpde("run s.dpde --json").json();
    return std::abs(found["observables"]["flux"].get<double>() - 1 / (a + 1e-3 * (1 - a)));
  };
  const auto is_told = [&] {
    const Outcome check = dpde("check s.dpde --json");
    EXPECT_EQ(check.json()["order"]["space"], told(check, "W0509") ? 1 : 2);
    return told(check, "W0509");
  };
  for (const int cells : {8, 16}) {
    EXPECT_LT(error(cells, 0.5), 1e-6) << cells;
    EXPECT_FALSE(is_told()) << cells;
  }
  for (const int cells : {32, 64, 128}) {
    EXPECT_GT(error(cells, 0.51), 0.3 / cells) << cells;
    EXPECT_TRUE(is_told()) << cells;
  }
}

/// Two vorticity layers of thickness 1/rho that roll up.
std::string layers(double rho, double nu, const std::string& scheme) {
  return fmt::format(
      "model m {{ field w; param rho = {}; solve lap(psi) = -w for psi\n"
      "  dt(w) = -advect((dy(psi), -dx(psi)), w) + {}*lap(w) }}\nscheme q {{ {}time = rk4 }}\nscene s : m with q {{\n"
      "  grid x = 0 .. 1, cells 48, periodic\n  grid y = 0 .. 1, cells 48, periodic\n  initial w = 0.3*cos(2*pi*x) +\n"
      "    if(y < 0.5, -rho*(1 - tanh(rho*(y - 0.25))^2), rho*(1 - tanh(rho*(0.75 - y))^2))\n"
      "  time 0 .. 0.6, step 1/200\n}}\n",
      rho, nu, scheme);
}

/// A spectrum that has not decayed at the cut-off of dealiasing, as for layers thinner than a cell.
TEST_F(Causes, WhatDealiasingCutsOffIsTold) {
  const std::string waves = "dx = spectral; lap = spectral; advect = spectral; dealias = two_thirds; ";
  const auto is_told = [&](double rho, double nu) {
    write("s.dpde", layers(rho, nu, waves));
    return told(dpde("run s.dpde --json"), "W0815");
  };
  EXPECT_TRUE(is_told(80, 1e-4));
  EXPECT_FALSE(is_told(15, 1e-3));
}

/// Along x, without steep gradients, no additional cells are requested, however fast the flow.
TEST_F(Causes, CellNumbersRingWhereItIsSteep) {
  const Json numbers = checked(layers(80, 1e-4, "")).json()["cell_numbers"];
  ASSERT_EQ(numbers.size(), 2u);
  for (const Json& number : numbers) {
    EXPECT_GT(number["number"].get<double>(), 2);
    EXPECT_EQ(number["rings"].get<bool>(), number["axis"] == "y") << number.dump();
  }
}

/// Unknowns of size 1e-6 and 5e4 are found as by Newton's method, and their scales are reported.
TEST_F(Causes, LbfgsTellsItsScales) {
  write("s.dpde",
        "model m { field u; param a = 1.2e-6, b = 5e4; dt(u) = -1e6*a*u + 1e-4*b }\nscheme q { time = rk4 }\n"
        "scene s : m with q { initial u = 1; time 0 .. 2, step 1/16 }\nscene truth = s { a = 1.7e-6; b = 4.2e4 }\n"
        "task t : s { data d = u from scene truth over time; unknown a; unknown b; minimise mean((u - d)^2) over time\n"
        "  using lbfgs(), iterations 60 }\n");
  const Json found = dpde("optimize s.dpde t --json").json();
  EXPECT_NEAR(found["unknowns"]["a"]["value"].get<double>(), 1.7e-6, 1e-11);
  EXPECT_NEAR(found["unknowns"]["b"]["value"].get<double>(), 4.2e4, 1);
  EXPECT_DOUBLE_EQ(found["scales"]["a"].get<double>(), 1.2e-6);
}

}  // namespace
}  // namespace dpde::testing
