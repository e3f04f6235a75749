// SPDX-License-Identifier: Apache-2.0
// Signs lost between the ends of steps: in stages, in substeps of subcycles and split steps, and before events. p
// swings within each step, equally in each one, and is back at the step's end. It also falls slowly from step to step,
// so the swing reaches the other side during the run, at a time that depends on k, but the ends of steps never do. The
// reference is differences of the loss.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/setting.h"
#include "watched_support.h"

namespace dpde::testing {
namespace {

/// A method, and a right-hand side F(t) with the period of one step h or two, for which the method's weights give 0.
/// With F/h, p falls to -1 in a stage. s is t/h.
struct Swing {
  std::string scheme, rate, parts = "", control = "";
};

std::vector<Swing> swings() {
  return {{"time = rk2", "(-1 - cos(2*pi*s))"},
          {"time = rk4", "(-0.5 - 1.5*cos(2*pi*s))"},
          {"time = ssp_rk3", "0.5*(-0.5 - 1.5*cos(2*pi*s))"},
          {"time = ars222", "(-0.5374 - 0.4626*cos(2*pi*s))/0.29289"},
          {"time = bs32", "(-0.2 - 1.8*cos(2*pi*s))", "", ", tolerance 1e3, first 1/400"},
          {"time = rk4", "(-0.5 - 1.5*cos(4*pi*s))*2", "", ", courant 2/5, speed 320"},
          {"time = euler", "-4*cos(2*pi*s)", "subcycle p, q in 4"},
          {"time = rk4", "-6.5*cos(2*pi*s)", "subcycle p, q in 4"},
          {"time = euler; split = strang(sources(p), sources(q), sources(u), diffusion)", "-2*cos(2*pi*s)"},
          {"time = verlet", "cos(pi*s)"},
          {"time = etdrk2; dx = spectral; lap = spectral", "cos(pi*s)"}};
}

/// `depth` of the swing; p falls from 1 to 0.5 in the run. q has the right-hand side `rate`, which may read v, fixed at
/// `held` in a cell; `events` follow each step.
struct SwingingTask {
  Swing swing;
  double depth = 0.8;
  std::string rate = "atan(1/p)", held = "", events = "";
};

std::string text_of_swing(const SwingingTask& task) {
  const bool is_verlet = task.swing.scheme == "time = verlet";  // verlet needs an equation of second order
  return "operator turned(z) order 0 = atan(1/z)\nscheme e { " + task.swing.scheme +
         " }\n"
         "model m { field u, v, w, p, q; param k = 1; mask wall; let s = 400*t\n dt(u) = lap(u) - u\n " +
         (is_verlet ? "dt(dt(w)) = -w" : "dt(w) = 0") + "\n dt(p) = -0.5*k + " + std::to_string(400 * task.depth) +
         "*(" + task.swing.rate + ")\n dt(v) = 0\n dt(q) = " + task.rate + "\n " +
         (task.held.empty() ? "" : "v = " + task.held + " inside wall") +
         "\n}\n"
         "scene z : m with e { grid x = 0 .. 4, cells 4, periodic\n wall = x < 1\n " +
         task.swing.parts + "\n " + task.events +
         "\n initial u = 0.1; initial v = 0; initial w = 0; initial p = 1; initial q = 0" +
         (is_verlet ? "; initial dt(w) = 0" : "") + "\n time 0 .. 1, step 1/400" + task.swing.control +
         "\n}\n"
         "task t : z { unknown k; minimise mean((q + 1)^2) }\n";
}

void expect_lost(const SwingingTask& task, bool is_lost) {
  const std::string text = text_of_swing(task);
  const FoundGradient found = gradient_of(text);
  EXPECT_EQ(found.is_refused, is_lost) << text;
  EXPECT_EQ(found.is_wrong(), is_lost) << text << found.gradient << " and " << found.secant;
}

const Swing of_rk4{"time = rk4", "(-0.5 - 1.5*cos(2*pi*s))"};

TEST(WatchedStages, AreRefusedByEachMethod) {
  for (const Swing& swing : swings()) expect_lost({swing}, true);
}

/// The swing does not reach 0.
TEST(WatchedStages, ThatKeepSignsAreTaken) {
  const std::vector<Swing> all = swings();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_tried(i, 3)) expect_lost({all[i], 0.2}, false);
  }
}

TEST(WatchedStages, AreRefusedInEachSpelling) {
  constexpr const char* jumping[] = {"sign(p)",         "if(p > 0, 1, 0.2)", "turned(p)",
                                     "mean(atan(1/p))", "atan(p^(-1))",      "exp(sign(-p))",
                                     "tanh(1/p^3)",     "if(p < 0.1, u, 1)", "atan(1/(p + 0*u))"};
  for (std::size_t i = 0; i < std::size(jumping); ++i) {
    if (is_tried(i, 3)) expect_lost({of_rk4, 0.8, "(1 + 0.1*p)*" + std::string(jumping[i])}, true);
  }
  constexpr const char* meeting[] = {"atan(1/(1.5 + p))", "p*atan(1/p)", "max(p, 0)", "if(p > 0, p, 0)", "tanh(1/p^2)"};
  for (std::size_t i = 0; i < std::size(meeting); ++i) {
    if (is_tried(i, 3)) expect_lost({of_rk4, 0.8, meeting[i]}, false);
  }
}

TEST(WatchedStages, AreRefusedWhereAFieldIsHeld) {
  expect_lost({of_rk4, 0.8, "v", "atan(1/p)"}, true);
  expect_lost({of_rk4, 0.2, "v", "atan(1/p)"}, false);
}

/// The state at a step's end differs from that at the next step's begin.
TEST(WatchedStages, AreRefusedBeforeEvents) {
  const Swing falling{"time = euler", "-1"};
  const std::string events = "after step: q = q + 0.01*atan(1/p)\n after step: p = p + ";
  expect_lost({falling, 0.8, "0.1", "", events + "0.8"}, true);
  expect_lost({falling, 0.2, "0.1", "", events + "0.2"}, false);
  const std::string both = "after step: q = q + 0.01*atan(1/p), p = p + ";
  expect_lost({falling, 0.8, "0.1", "", both + "0.8"}, true);
}

/// Equations outside the subcycle read p only at the ends of steps.
TEST(WatchedStages, OfPartsThatNobodyTakesAreNotLookedAt) {
  expect_lost({{"time = euler", "-4*cos(2*pi*s)", "subcycle p in 4"}, 0.8}, false);
}

/// A substep of a split step begins with values that are not a state of the run.
TEST(WatchedStages, AreRefusedOfPartsOfSteadySteps) {
  const auto resting = [](const std::string& least) {
    return "scheme e { time = euler; split = lie(sources(u), sources(q), diffusion) }\n"
           "model m { field u, q; param k = 1; dt(u) = lap(u) + 20*(k - u) + 1024*(" +
           least +
           " + 0.1*x)*sin(16*pi*x)\n dt(q) = 20*(atan(1/u) - q)\n}\n"
           "scene z : m with e { grid x = 0 .. 1, cells 16, periodic\n initial u = 1; initial q = 0\n"
           " time 0 .. 3, step 0.0015, until steady 1e-9\n}\n"
           "task t : z { unknown k; minimise mean(q) }\n";
  };
  for (const bool is_lost : {true, false}) {
    const FoundGradient found = gradient_of(resting(is_lost ? "0.84" : "0.5"));
    EXPECT_EQ(found.is_refused, is_lost);
    EXPECT_EQ(found.is_wrong(), is_lost) << found.gradient << " and " << found.secant;
  }
}

}  // namespace
}  // namespace dpde::testing
