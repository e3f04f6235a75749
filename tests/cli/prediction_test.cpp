// SPDX-License-Identifier: Apache-2.0
// dpde check: predictions before a run against the resources of the run.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class PredictionCommand : public Command {
 protected:
  std::string scene(const std::string& rate, const std::string& time, const std::string& when) const {
    return "model m { field u; param k; dt(u) = " + rate +
           " }\nscene s : m {\n  grid x = 0 .. 1, cells 16384, periodic\n  initial u = sin(2*pi*x)\n  k = 1e-9\n  " +
           time + "\n}\nscheme e { time = euler }\ntask t : s { unknown initial u; minimise mean(u^2)" + when + " }\n";
  }
  double stored(const std::string& file) const {
    return dpde("gradient " + file + " t --force --json").json()["checkpoints"]["bytes"];
  }
};

/// Buffers are whole pages and a little apart: up to 4 per cent of fields of this size.
TEST_F(PredictionCommand, PredictsTheStatesOfAGradient) {
  write("all.dpde", scene("-u*dx(u)", "time 0 .. 1/2048, step 1/32768", ""));
  write("early.dpde", scene("-u*dx(u)", "time 0 .. 1/2048, step 1/32768", " at t = 1/4096"));
  write("none.dpde", scene("k*lap(u)", "time 0 .. 1/2048, step 1/32768", ""));
  const double field = 16384 * 8;
  const std::pair<const char*, double> expected[] = {
      {"all.dpde", 17 * field}, {"early.dpde", 9 * field}, {"none.dpde", 4 * field}};
  for (const auto& [file, bytes] : expected) {
    const Outcome outcome = dpde("check " + std::string(file) + " t --json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const double predicted = outcome.json()["gradient_memory_bytes"];
    EXPECT_NEAR(predicted, bytes, 0.04 * bytes) << file;
    EXPECT_EQ(predicted, stored(file)) << file;
    EXPECT_EQ(outcome.json()["gradient_memory_bytes_per_part"], 0);
  }
  EXPECT_NE(dpde("check all.dpde --all t").out.find("for a gradient that stores every step"), std::string::npos);
  EXPECT_NE(dpde("check none.dpde --all t").out.find("for a gradient that stores none"), std::string::npos);
}

/// The plan of check is that of the run, with and without blocks of steps, for memory budgets and in a file.
TEST_F(PredictionCommand, PredictsWhatBlockedGradientsStore) {
  const auto text = [](int nx, int ny, const std::string& sides, const std::string& rate, int steps,
                       const std::string& losses) {
    return fmt::format(
        "model m {{ field u, v; coefficient w; param k; control field f; dt(u) = {}; dt(v) = -0.1*u*v }}\n"
        "scene s : m {{\n  grid x = 0 .. 1, cells {}{}\n  grid y = 0 .. 1, cells {}, periodic\n{}  initial u = "
        "sin(2*pi*x)\n  initial v = 1\n  w = 1\n  k = 1e-9\n"
        "  f = x every 1/512\n  time 0 .. {}/4096, step 1/4096\n}}\nscheme e {{ time = euler }}\ntask t : s {{ unknown "
        "initial u; unknown w; {} }}\n",
        rate, nx, sides.empty() ? ", periodic" : "", ny, sides, steps, losses);
  };
  const std::string walls = "  boundary u: all = 0\n  boundary v: all = zero_gradient\n", end = "minimise mean(u^2)";
  const std::string often = "minimise mean(u*v) over time", at = "minimise mean(u^2) at t = 5/4096, 24/4096";
  struct Case {
    std::string text, options;
    int least_block;
  };
  const std::vector<Case> cases{{text(512, 512, "", "-u*dx(u) + w*u", 24, end), "", 4},
                                {text(512, 512, "", "-u*dx(u) + w*u + f", 24, end), "", 4},
                                {text(512, 512, "", "-u*dx(u) + w*u", 24, at), "", 2},
                                {text(512, 512, "", "-u*dx(u) + w*u", 24, often), "", 1},
                                {text(512, 512, "", "-u*dx(u) + w*u", 24, end), "--memory 26M", 2},
                                {text(512, 512, walls, "-u*dx(u) + w*u", 24, end), "--memory 40M", 1},
                                {text(512, 512, "", "-u*dx(u) + w*u", 24, end), "--memory 30M --checkpoints-in .", 2},
                                {text(512, 512, "", "-u*dx(u) + w*u", 23, end), "--set real=f32", 1},
                                {text(640, 448, "", "-u*dx(u) + 1e-9*w*lap(u)", 29, at), "--threads 2", 2},
                                {text(7, 3, "", "-u*dx(u) + w*u", 9, end), "", 1},
                                {text(1, 1, walls, "-u*dx(u) + w*u", 3, often), "--memory 3K", 1}};
  for (std::size_t count = 0; const Case& c : cases) {
    if (!is_tried(count++, 2)) continue;
    write("blocks.dpde", c.text);
    const Outcome check = dpde("check blocks.dpde t --json " + c.options),
                  run = dpde("gradient blocks.dpde t --json --no-certify " + c.options);
    ASSERT_EQ(check.status, 0) << check.err;
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(check.json()["checkpoints"], run.json()["checkpoints"]) << c.options << "\n" << c.text;
    EXPECT_GE(run.json()["checkpoints"]["block_steps"], c.least_block) << c.options << "\n" << c.text;
    EXPECT_GE(check.json()["gradient_memory_bytes"], check.json()["checkpoints"]["bytes"]);
  }
  write("blocks.dpde", cases.front().text);
  EXPECT_NE(dpde("check blocks.dpde --all t").out.find("steps at once"), std::string::npos);
  EXPECT_NE(dpde("check blocks.dpde t --memory 1K --json").status, 0) << "no room for a gradient";
  EXPECT_NE(dpde("check blocks.dpde t --memory much --json").status, 0);
}

/// Intermediate values of networks are stored too, as far as memory allows.
TEST_F(PredictionCommand, PredictsWhatIsKeptOfNetworks) {
  write("net.dpde",
        "network law(u) { conv 8, 3; tanh; conv out, 3 }\nmodel m { field u; param nu; dt(u) = nu*lap(u) + law(u) }\n"
        "scene s : m {\n  grid x = 0 .. 1, cells 512, periodic\n  initial u = sin(2*pi*x)\n  nu = 1e-4\n  time 0 .. "
        "1/8, step 1/128\n}\n"
        "task t : s { learn law; minimise mean(u^2) }\n");
  std::set<double> kept;
  for (const std::string more : {"", "--memory 200K", "--memory 600K", "--threads 2"}) {
    const Outcome check = dpde("check net.dpde t --json " + more),
                  run = dpde("gradient net.dpde t --json --no-certify " + more);
    ASSERT_EQ(check.status, 0) << check.err;
    ASSERT_EQ(run.status, 0) << run.err;
    const Json said = check.json()["checkpoints"];
    EXPECT_EQ(said, run.json()["checkpoints"]) << more;
    EXPECT_EQ(check.json()["gradient_memory_bytes"].get<double>(),
              said["bytes"].get<double>() + said["tape_bytes"].get<double>())
        << more;
    kept.insert(said["tape_bytes"].get<double>());
  }
  EXPECT_GE(kept.size(), 3u) << "of other budgets other amounts";
  EXPECT_NE(dpde("check net.dpde --all t").out.find(" of what networks and solves find"), std::string::npos);
}

/// 16384 cells, speed 1, steps of 1/2048 at a Courant number of 0.5: 16 substeps each.
TEST_F(PredictionCommand, PredictsTheStatesBetweenThePartsOfSteps) {
  write("parts.dpde", scene("-u*dx(u)", "time 0 .. 1/512, step 1/2048, courant 0.5, speed 1", ""));
  const Outcome outcome = dpde("check parts.dpde t --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const double whole = outcome.json()["gradient_memory_bytes"], part = outcome.json()["gradient_memory_bytes_per_part"],
               used = stored("parts.dpde");
  EXPECT_NEAR(part, 16384 * 8, 0.01 * part);
  EXPECT_NEAR(whole + 16 * part, used, 0.04 * used);
  EXPECT_NE(dpde("check parts.dpde --all t").out.find("more for each part of the step that is split into most"),
            std::string::npos);
}

/// The kernel of a boundary value has an internal name of the compiler.
TEST_F(PredictionCommand, SaysOnceAndAtItsPlaceWhatHasNoDerivative) {
  write("wall.dpde",
        "model m { field u; param a; dt(u) = lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  boundary u: x.low "
        "= 1, x.high = floor(3*a)*x\n"
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
