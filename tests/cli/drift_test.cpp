// SPDX-License-Identifier: Apache-2.0
// Drift of conserved sums over a run.
#include <algorithm>
#include <cmath>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using Drift = Command;

const std::string viscous_shock =
    "model m { field u; param nu; dt(u) = -dx(u^2/2) + nu*lap(u) }\nscheme c { time = rk4 }\nscene s : m with c {\n"
    "  grid x = 0 .. 1, cells 64, periodic\n  nu = 0.01\n  initial u = 1 + sin(2*pi*x)\n  observe mass = integral(u)\n"
    "  time 0 .. 1, step 1/1024\n}\n";

/// The integral is always 1 up to rounding: at most one unit per step.
TEST_F(Drift, OfWhatIsConservedIsRounding) {
  write("s.dpde", viscous_shock);
  const Outcome run = dpde("run s.dpde --json");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(run.codes().empty()) << run.err;
  const Json drift = run.json()["drift"];
  ASSERT_EQ(drift.size(), 2u) << drift;  // not the integral of u^2, which diffusion lowers
  for (const std::string name : {"integral(u)", "mass"}) {
    EXPECT_NEAR(drift[name]["begin"].get<double>(), 1, 1e-14) << name;
    EXPECT_LT(std::abs(drift[name]["per_time"].get<double>()), 1e-13) << name;
    EXPECT_LT(drift[name]["relative"].get<double>(), 1e-13) << name;
    EXPECT_EQ(drift[name]["per_time"].get<double>(),
              drift[name]["end"].get<double>() - drift[name]["begin"].get<double>());
  }
  EXPECT_NE(dpde("run s.dpde").out.find("drift a unit of time: integral(u) "), std::string::npos);
}

/// Central differences conserve the energy in advection. RK4 takes from the wave of 8 cells in each step 1 - |g|^2 =
/// y^6/72 - y^8/576, y = step*sin(pi/4).
TEST_F(Drift, OfAnEnergyIsWhatStepsInTimeLose) {
  const auto text = [](const std::string& advect) {
    return "model m { field u; dt(u) = -advect(1, u) }\nscheme c { advect = " + advect +
           "; time = rk4 }\nscene s : m with c {\n  grid x = 0 .. 32, cells 32, periodic\n"
           "  initial u = sin(pi/4*x)\n  time 0 .. 100, step 1\n}\n";
  };
  write("s.dpde", text("central(2)"));
  const Outcome run = dpde("run s.dpde --json");
  EXPECT_TRUE(run.codes().empty()) << run.err;
  const Json energy = run.json()["drift"]["integral(u^2)"];
  const double y = std::sqrt(0.5), left = 1 - std::pow(y, 6) / 72 + std::pow(y, 8) / 576;
  EXPECT_NEAR(energy["begin"].get<double>(), 16, 1e-12);
  EXPECT_NEAR(energy["per_time"].get<double>(), 16 * (std::pow(left, 100) - 1) / 100, 1e-10);
  EXPECT_TRUE(energy["but_for_steps"].get<bool>());
  EXPECT_NE(dpde("run s.dpde").out.find("integral(u^2) -0.024"), std::string::npos);
  const Json check = dpde("check s.dpde --json").json();
  EXPECT_EQ(check["conserved"], Json{"integral(u)"});
  EXPECT_EQ(check["conserved_but_for_steps"], Json{"integral(u^2)"});
  write("s.dpde", text("upwind(3)"));  // the difference itself loses energy
  EXPECT_EQ(dpde("check s.dpde --json").json()["conserved_but_for_steps"], Json::array());
}

/// A source that acts for some time during the run: the sum is not reported as conserved. A source that acts only
/// before or after the run, or at no point, changes nothing.
TEST_F(Drift, OfSourcesThatAreOnForAWhileIsNone) {
  struct Source {
    std::string rate;
    bool acts;
  };
  const auto conserves = [&](const std::string& rate, const std::string& time) {
    write("s.dpde", "model m { field u; param a = 1.1; dt(u) = 0.01*lap(u) + " + rate +
                        " }\nscheme q { time = " + time +
                        " }\nscene s : m with q {\n  grid x = 0 .. 1, cells 16, periodic\n"
                        "  initial u = 1\n  time 0 .. 3, step 0.01\n}\n");
    const Outcome check = dpde("check s.dpde --json");
    EXPECT_EQ(check.status, 0) << check.err;
    const Json sums = check.json()["conserved"];
    return std::find(sums.begin(), sums.end(), "integral(u)") != sums.end();
  };
  for (const Source& source : std::vector<Source>{{"if(t > 1 and t < 1.2 and x > 0.8 and x < 0.9, 1, 0)*u", true},
                                                  {"if(x > 0.8 and t < a + 0.1 and x < 0.9 and t > a, -1, 0)", true},
                                                  {"if(abs(t - 2.11) < 0.02, sin(2*pi*x) + 1, 0)", true},
                                                  {"exp(-((t - 1.1)/0.02)^2)*u", true},
                                                  {"exp(-((t - 1.1)^2 + (x - 0.5)^2)/0.001)", true},
                                                  {"if(t > 3.1 or t < 0, 1, 0)", false},
                                                  {"if(t > 1 and t < 1.2 and x > 2, 1, 0)", false},
                                                  {"if(t > 1 and t < 1.2, sin(2*pi*x), 0)", false}})
    EXPECT_EQ(conserves(source.rate, "rk2"), !source.acts) << source.rate;
  for (const std::string time : {"euler", "ab2", "ab3", "rk4"}) {
    EXPECT_FALSE(conserves("if(t > 1 and t < 1.2, 1, 0)*u", time)) << time;
    EXPECT_TRUE(conserves("0*if(t > 1 and t < 1.2, 1, 0)*u", time)) << time;
  }
}

/// The other component of a vector gives the scale of rounding.
TEST_F(Drift, OfAComponentThatIsZeroIsRounding) {
  write("s.dpde",
        "model m { vector u; dt(u) = 0.001*lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 16, periodic\n"
        "  grid y = 0 .. 1, cells 16, periodic\n  initial u = (1 + sin(2*pi*x), 1e-19*sin(2*pi*y)^2*x)\n"
        "  time 0 .. 1, step 1/64\n}\n");
  EXPECT_TRUE(dpde("run s.dpde --json").codes().empty());
}

/// Random states on few cells blow up with the scene's step: the sum is not reported as conserved.
TEST_F(Drift, OfWhatBlowsUpFromRandomStates) {
  write("s.dpde",
        "model m { field n, w; solve lap(p) = w for p; dt(n) = p - n - bracket(p, n); dt(w) = p - n - bracket(p, w) }\n"
        "scheme c { lap = spectral; time = rk4 }\nscene s : m with c {\n"
        "  grid x = 0 .. 40, cells 64, periodic\n  grid y = 0 .. 40, cells 64, periodic\n"
        "  initial n = sin(pi*x/20)\n  initial w = cos(pi*y/10)\n  time 0 .. 1, step 0.025\n}\n");
  const Json check = dpde("check s.dpde --json").json();
  EXPECT_EQ(check["conserved"], Json::array());
  EXPECT_EQ(check["conserved_but_for_steps"], Json::array());
}

/// Energy of a flow by its stream function, as an observable: time stepping loses it.
TEST_F(Drift, OfObservablesThatStepsLose) {
  write("s.dpde",
        "model m { field w; solve lap(p) = w for p; dt(w) = -bracket(p, w) }\n"
        "scheme c { lap = spectral; time = rk4 }\nscene s : m with c {\n"
        "  grid x = 0 .. 40, cells 64, periodic\n  grid y = 0 .. 40, cells 64, periodic\n"
        "  initial w = sin(pi*x/20) + cos(pi*y/10)\n  observe energy = mean(p*w)\n  time 0 .. 1, step 0.025\n}\n");
  const Json check = dpde("check s.dpde --json").json();
  EXPECT_EQ(check["conserved"], Json{"integral(w)"});
  EXPECT_EQ(check["conserved_but_for_steps"], (Json{"energy", "integral(w^2)"}));
}

/// Nothing is conserved: no message.
TEST_F(Drift, OfNothingIsNotTold) {
  write("s.dpde",
        "model m { field u; dt(u) = lap(u) - u }\nscene s : m {\n  grid x = 0 .. 1, cells 8, periodic\n"
        "  initial u = 1 + sin(2*pi*x)\n  time 0 .. 1/8, step 1/512\n}\n");
  const Outcome run = dpde("run s.dpde");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.out.find("drift"), std::string::npos) << run.out;
}

/// From 5 to 11.25 the field v reaches the threshold of a source, which no step sees at the beginning.
TEST_F(Drift, OfSourcesThatStatesSwitchOnIsNone) {
  struct Source {
    std::string rate;
    bool acts;
  };
  const std::vector<Source> sources = {{"if(v > 9 and v < 9.45, 1, 0)", true},
                                       {"if(v > 3*w, 1, 0)*u", true},
                                       {"max(0, v - 9)", true},
                                       {"0.5 + 0.5*tanh((v - 9)/0.01)", true},
                                       {"exp(-((v - 9)/0.02)^2)", true},
                                       {"if(v*w > 30, 1, 0)", true},
                                       {"if(v^2 > 81, u, 0)", true},
                                       {"if(sqrt(v) > 3, 1, 0)", true},
                                       {"source(v)", true},
                                       {"if(v > 9, dx(w), 0)*0", false},
                                       {"dx(max(0, v - 9))", false},
                                       {"lap(if(v > 9 and v < 9.45, v, 0))", false}};
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (!is_tried(i, 3)) continue;
    write("s.dpde", "operator source(z) order 0 = if(z < 9, 0, 1)\nmodel m { field u, v, w; dt(u) = lap(u) + " +
                        sources[i].rate +
                        "; dt(v) = 50; dt(w) = 0.1*lap(w) }\nscheme c { time = euler }\n"
                        "scene s : m with c {\n  grid x = 0 .. 1, cells 8, periodic\n  initial u = 1 + sin(2*pi*x)\n"
                        "  initial v = 5\n  initial w = 3\n  time 0 .. 1/8, step 1/512\n}\n");
    const Json check = dpde("check s.dpde --json").json();
    const auto has = [&](const char* list) {
      return std::ranges::count(check[list], Json("integral(u)")) +
             std::ranges::count(check[list], Json("integral(w)"));
    };
    EXPECT_EQ(has("conserved"), sources[i].acts ? 1 : 2) << sources[i].rate << check.dump();
    EXPECT_EQ(has("conserved_until_switched"), sources[i].acts ? 1 : 0) << sources[i].rate;
    EXPECT_TRUE(dpde("run s.dpde --json").codes().empty()) << sources[i].rate;
  }
}

/// The source needs two states together, which none of the sampled states has.
TEST_F(Drift, BeyondRoundingIsAWarning) {
  write("s.dpde",
        "model m { field u, v, w; dt(u) = lap(u) + if(abs(v - 3.7129*w) < 0.2 and abs(w - 2.4817) < 0.0005, 1, 0)\n"
        "  dt(v) = 50; dt(w) = 0*w }\nscheme c { time = euler }\nscene s : m with c {\n"
        "  grid x = 0 .. 1, cells 8, periodic\n  initial u = 1 + sin(2*pi*x)\n"
        "  initial v = 5\n  initial w = 2.4817\n  time 0 .. 1/8, step 1/512\n}\n");
  const Outcome run = dpde("run s.dpde --json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.codes(), std::vector<std::string>{"W0805"}) << run.err;
  EXPECT_NEAR(run.json()["drift"]["integral(u)"]["per_time"].get<double>(), 4.0 / 512 * 8, 1e-9);
}

/// The mass of a sine is 0: its rounding is compared with the mass of |u|.
TEST_F(Drift, OfASumThatIsNothingIsComparedWithWhatItAddsUp) {
  write("s.dpde",
        "model m { field u; dt(u) = -advect(1, u) }\nscheme c { advect = central(2); time = rk4; real = f32 }\n"
        "scene s : m with c {\n  grid x = 0 .. 1, cells 32, periodic\n  initial u = sin(2*pi*x)\n"
        "  observe mass = integral(u)\n  time 0 .. 10, step 0.02\n}\n");
  const Outcome run = dpde("run s.dpde --json");
  EXPECT_TRUE(run.codes().empty()) << run.err;
  const Json drift = run.json()["drift"]["mass"];
  EXPECT_LT(std::abs(drift["begin"].get<double>()), 1e-6);
  EXPECT_LT(drift["relative"].get<double>(), 1e-5) << "of 2/pi";
}

/// A run continued from a checkpoint measures from there.
TEST_F(Drift, GoesOnWithARun) {
  write("s.dpde", viscous_shock);
  ASSERT_EQ(dpde("run s.dpde --out o --checkpoint-every 100 --quiet").status, 0);
  const Outcome again = dpde("run s.dpde --out o --resume --json");
  EXPECT_EQ(again.status, 0) << again.err;
}

/// Walls with values on all sides: inflow at x.low stays inside, except for the outflow at x.high.
TEST_F(Drift, OfAConstraintThatCannotBeTrueIsAWarning) {
  const auto text = [](const std::string& right) {
    return "model flow { vector u on faces; field p; param nu; dt(u) = -grad(p) + nu*lap(u); 0 = div(u) gives p }\n"
           "scene s : flow {\n  grid x = 0 .. 1, cells 8\n  grid y = 0 .. 1, cells 8\n  nu = 0.1\n  initial u = 0\n"
           "  boundary u.x: x.low = 1, x.high = " +
           right +
           ", y = 0\n  boundary u.y: all = 0\n"
           "  time 0 .. 0.1, step 0.01\n}\n";
  };
  write("s.dpde", text("0"));
  const Outcome closed = dpde("run s.dpde --json");
  EXPECT_EQ(closed.status, 0) << closed.err;
  EXPECT_EQ(closed.codes(), std::vector<std::string>{"W0807"}) << closed.err;
  EXPECT_NEAR(closed.json()["constraints"]["p"].get<double>(), 1, 1e-10);
  for (const std::string right : {"1", "outflow"}) {
    write("s.dpde", text(right));
    const Outcome open = dpde("run s.dpde --json");
    EXPECT_TRUE(open.codes().empty()) << open.err;
    EXPECT_LT(open.json()["constraints"]["p"].get<double>(), 1e-12) << right;
  }
}

}  // namespace
}  // namespace dpde::testing
