// SPDX-License-Identifier: Apache-2.0
// dpde check: what it says before a run against what the run then takes.
#include <cmath>

#include "command_support.h"

namespace dpde::testing {
namespace {

class PredictionCommand : public Command {
 protected:
  std::string scene(const std::string& rate, const std::string& time, const std::string& when) const {
    return "model m { field u; param k; dt(u) = " + rate + " }\nscene s : m {\n  grid x = 0 .. 1, cells 16384, periodic\n  initial u = sin(2*pi*x)\n  k = 1e-9\n  " + time +
           "\n}\nscheme e { time = euler }\ntask t : s { unknown initial u; minimise mean(u^2)" + when + " }\n";
  }
  double stored(const std::string& file) const { return dpde("gradient " + file + " t --json").json()["checkpoints"]["bytes"]; }
};

/// Buffers lie at distances of whole pages and a little: up to 4 per cent of fields of this size.
TEST_F(PredictionCommand, PredictsTheStatesOfAGradient) {
  write("all.dpde", scene("-u*dx(u)", "time 0 .. 1/2048, step 1/32768", ""));
  write("early.dpde", scene("-u*dx(u)", "time 0 .. 1/2048, step 1/32768", " at t = 1/4096"));
  write("none.dpde", scene("k*lap(u)", "time 0 .. 1/2048, step 1/32768", ""));
  const double field = 16384 * 8;
  const std::pair<const char*, double> expected[] = {{"all.dpde", 17 * field}, {"early.dpde", 9 * field}, {"none.dpde", 4 * field}};
  for (const auto& [file, bytes] : expected) {
    const Outcome outcome = dpde("check " + std::string(file) + " t --json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const double predicted = outcome.json()["gradient_memory_bytes"];
    EXPECT_NEAR(predicted, bytes, 0.01 * bytes) << file;
    EXPECT_NEAR(predicted, stored(file), 0.04 * bytes) << file;
    EXPECT_EQ(outcome.json()["gradient_memory_bytes_per_part"], 0);
  }
  EXPECT_NE(dpde("check all.dpde t").out.find("for a gradient that stores every step"), std::string::npos);
  EXPECT_NE(dpde("check none.dpde t").out.find("for a gradient that stores none"), std::string::npos);
}

/// 16384 cells, speed 1, steps of 1/2048 at a Courant number of 0.5: 16 parts each.
TEST_F(PredictionCommand, PredictsTheStatesBetweenThePartsOfSteps) {
  write("parts.dpde", scene("-u*dx(u)", "time 0 .. 1/512, step 1/2048, courant 0.5, speed 1", ""));
  const Outcome outcome = dpde("check parts.dpde t --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const double whole = outcome.json()["gradient_memory_bytes"], part = outcome.json()["gradient_memory_bytes_per_part"], used = stored("parts.dpde");
  EXPECT_NEAR(part, 16384 * 8, 0.01 * part);
  EXPECT_NEAR(whole + 16 * part, used, 0.04 * used);
  EXPECT_NE(dpde("check parts.dpde t").out.find("more for each part of the step that is split into most"), std::string::npos);
}

/// The kernel of a boundary value has a name that only the compiler knows.
TEST_F(PredictionCommand, SaysOnceAndAtItsPlaceWhatHasNoDerivative) {
  write("wall.dpde", "model m { field u; param a; dt(u) = lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  boundary u: x.low = 1, x.high = floor(3*a)*x\n"
                     "  initial u = 0\n  a = 1\n  time 0 .. 1/512, step 1/512\n}\ntask t : s { unknown a; minimise mean(u^2) }\n");
  for (const char* verb : {"check", "verify", "gradient"}) {
    const Outcome outcome = dpde(std::string(verb) + " wall.dpde t --json");
    EXPECT_EQ(outcome.codes(), std::vector<std::string>{"E0601"}) << verb;
    const Json told = outcome.json()["diagnostics"][0];
    EXPECT_EQ(told["line"], 4) << told;
    EXPECT_EQ(told["message"].get<std::string>().find("floor here has no derivative"), 0u) << told;
  }
}

}  // namespace
}  // namespace dpde::testing
