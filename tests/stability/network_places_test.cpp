// SPDX-License-Identifier: Apache-2.0
// Limits of steps with networks that act on a part of the grid, by what they hold there, as rates and as coefficients;
// of places alone, of what does not change, of what another network holds, and of the state itself. Beside each limit a
// run goes on and a run blows up.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "stability/stability_report.h"
#include "stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// N(s) = 40 + 60 s by its two weights; u' = -(what it gives) u + w by rk4.
struct NetworkUse {
  std::string name, model, rate;
  bool is_of_state = false;  // the network reads what is perturbed: an estimate to a part in a hundred
};

const std::string still_v = "  dt(v) = 0\n";

const std::vector<NetworkUse> network_uses{
    {"held", still_v + "  v = N(x) inside b\n", "v*u"},
    {"held, of a coefficient", still_v + "  v = N(c) inside b\n", "v*u"},
    {"held, of a let", "  let a = N(c)\n" + still_v + "  v = a inside b\n", "v*u"},
    {"held, of what is held", "  field q\n  dt(q) = 0\n  q = c inside b\n" + still_v + "  v = N(q) inside b\n", "v*u"},
    {"held, before what is held", "  field q\n  dt(q) = 0\n  q = N(c) inside b\n" + still_v + "  v = q inside b\n",
     "v*u"},
    {"held, of a network", "  field q\n  dt(q) = 0\n  q = N(x)/100 inside b\n" + still_v + "  v = N(q) inside b\n",
     "v*u"},
    {"held, of a solution", "  solve lap(p) - p = -c for p\n" + still_v + "  v = N(p) inside b\n", "v*u"},
    {"held, later", "  param length = 1\n" + still_v + "  v = N(min(1, 2*t/length)) inside b\n", "v*u"},
    {"a rate", still_v, "N(x)*b*u"},
    {"a rate of a state that is still", "  field q\n  dt(q) = 0\n  q = c inside b\n" + still_v, "N(q)*b*u"},
    {"a flux", still_v, "(b*N(x)*u - 0.01*dx(N(c)*dx(u)))"},
    {"of the state, held", still_v + "  v = N(u) inside b\n", "v", true},
    {"of the state, beside what is held", still_v + "  v = 80*c inside b\n", "(v*u + N(u)/30)", true},
    {"of the state, beside a network", still_v + "  v = N(x) inside b\n", "(v*u + N(u)/30)", true},
    {"of the state, as a rate", still_v, "b*N(u)", true},
};

struct NetworkPlace {
  std::string mask;
  int rank, cells;
};

const std::vector<NetworkPlace> network_places{
    {"x < 0.1", 1, 16},
    {"abs(x - 0.62) < 0.04", 1, 16},
    {"x > 0.9", 1, 64},
    {"x < 0.5", 1, 48},
    {"x < 2", 1, 8},
    {"abs(x - 0.8) < 0.03", 1, 200},
    {"(x - 0.8)^2 + (y - 0.2)^2 < 0.1^2", 2, 16},
    {"(x - 0.3)^2 + (y - 0.6)^2 < 0.3^2", 2, 12},
    {"x > 0.9 and y < 0.1", 2, 16},
    {"x < 2", 2, 8},
};

std::unique_ptr<driver::Session> network_scene(const NetworkUse& use, const NetworkPlace& place, double step) {
  std::string text =
      "network N(s: scalar) -> scalar {\n  real f64\n  conv out, 1, initial = zero\n}\nmodel m {\n"
      "  field u, v, w\n  mask b\n  coefficient c\n" +
      use.model;
  text +=
      fmt::format("  dt(u) = -{} + w\n  dt(w) = 0\n}}\nscheme r {{ time = rk4 }}\nscene s : m with r {{\n", use.rate);
  for (int axis = 0; axis < place.rank; ++axis)
    text += fmt::format("  grid {} = 0 .. 1, cells {}, periodic\n", "xy"[axis], place.cells);
  if (use.model.find("param length") != std::string::npos) text += fmt::format("  length = 600*{}\n", step);
  if (use.model.find("field q") != std::string::npos) text += "  initial q = 0\n";
  text += fmt::format(
      "  b = {}\n  c = 0.3 + 0.7*x\n  initial u = 1; initial v = 0; initial w = 1 + x\n  time 0 .. {}, step {}\n}}\n",
      place.mask, 600 * step, step);
  auto session = open_scene(text);
  for (auto& [name, weights] : session->workspace().weights()) {
    weights.values.front() = 60;
    weights.values.back() = 40;
  }
  return session;
}

double largest_after_networks(const NetworkUse& use, const NetworkPlace& place, double step) {
  const auto session = network_scene(use, place, step);
  session->rollout().run();
  double largest = 0;
  for (const double value : session->final_state(0)) largest = std::max(largest, std::abs(value));
  return std::isfinite(largest) ? largest : 1e300;
}

TEST(NetworkPlaces, LimitsAreThoseOfRunsWhereverTheMaskIs) {
  std::size_t count = 0;
  for (const NetworkPlace& place : network_places) {
    for (const NetworkUse& use : network_uses) {
      if (!testing::is_tried(count++, 37)) continue;
      const std::string what = fmt::format("{}: {}, {} cells, rank {}", use.name, place.mask, place.cells, place.rank);
      const StabilityReport verdict = verdict_of(*network_scene(use, place, 0.001));
      ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << what << verdict.why;
      EXPECT_EQ(verdict.is_of_networks, use.is_of_state) << what;
      const double limit = verdict.limit.step;
      EXPECT_LT(largest_after_networks(use, place, 0.97 * limit), 1e4) << what << ": " << limit;
      EXPECT_GT(largest_after_networks(use, place, 1.05 * limit), 1e4) << what << ": " << limit;
      for (const double step : {1.03 * limit, 0.1}) {
        const StabilityReport again = verdict_of(*network_scene(use, place, step));
        EXPECT_NEAR(again.limit.step, limit, (use.is_of_state ? 2e-2 : 2e-3) * limit) << what << " at " << step;
        EXPECT_EQ(grows_nothing(*network_scene(use, place, step)), step < limit) << what << " at " << step;
      }
    }
  }
}

/// What a network gives of places is what the formula would give: the verdict is the same, walls and means included.
TEST(NetworkPlaces, WhatIsKnownIsAsACoefficient) {
  const auto limit = [](const std::string& rate, const std::string& side, bool is_network) {
    const std::string network = "network N(s: scalar) -> scalar {\n  real f64\n  conv out, 1, initial = zero\n}\n",
                      formula = "function N(s) = 40 + 60*s\n";
    const auto session = open_scene((is_network ? network : formula) + "model m { field u; dt(u) = " + rate +
                                    " }\nscheme r { time = rk4 }\nscene s : m with r {\n  grid x = 0 .. 1, cells 24" +
                                    side + "\n  initial u = 1 + x\n  time 0 .. 1, step 1e-4\n}\n");
    for (auto& [name, weights] : session->workspace().weights()) weights.values = {60, 40};
    return verdict_of(*session);
  };
  const std::string ring = ", periodic", wall = "\n  boundary u: x = 0";
  for (const auto& [rate, side] : {std::pair{std::string("N(x)*lap(u)"), ring},
                                   {"N(x)*lap(u)", wall},
                                   {"-N(x)*dx(u)", wall},
                                   {"-N(x)*u + lap(u)", wall},
                                   {"-N(x)*mean(N(x)*u)", ring},
                                   {"-u*N(x)*t", ring},
                                   {"-N(x)*mean(u^2)", ring},
                                   {"-N(sin(3*t))*u", ring}}) {
    const StabilityReport of_network = limit(rate, side, true), of_formula = limit(rate, side, false);
    ASSERT_EQ(of_network.limit.kind, of_formula.limit.kind) << rate << side << of_network.why;
    EXPECT_NEAR(of_network.limit.step, of_formula.limit.step, 2e-3 * of_formula.limit.step) << rate << side;
    // On its own grid a network that changes with time is not analysed, a formula is.
    const bool varies = rate.find("sin(3*t)") != std::string::npos;
    EXPECT_EQ(of_network.is_of_grid, of_formula.is_of_grid && !varies) << rate << side;
    EXPECT_EQ(of_network.is_of_means, of_formula.is_of_means) << rate << side;
  }
}

}  // namespace
}  // namespace dpde::stability
