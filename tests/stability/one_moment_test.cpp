// SPDX-License-Identifier: Apache-2.0
// The limit is that of a scheme's regular steps and does not depend on the run's length: multistep schemes begin with
// other steps, stages are at later times, and a run may be shorter than one step at its limit. Compared with closed
// forms and runs.
#include "stability/frozen/one_moment.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "stability/trial.h"

namespace dpde::stability {
namespace {

constexpr double coefficient = 0.01;
constexpr int cells = 13;

struct Case {
  std::string time, equation;
  double first_order;  // the limit times the largest rate; 0: second order in time
  double second_order = 0;
};

std::unique_ptr<driver::Session> open_case(const Case& c, bool is_ring, double begin, double length) {
  return open_scene(fmt::format(
      "model m {{ field u; {} }}\nscheme c {{ time = {} }}\nscene s : m with c {{\n  grid x = 0 .. 1, cells {}{}\n"
      "  initial u = noise(1)\n{}  time {} .. {}, step 1e-6\n}}\n",
      c.equation, c.time, cells, is_ring ? ", periodic\n" : "\n  boundary u: x = zero_gradient",
      c.second_order > 0 ? "  initial dt(u) = 0\n" : "", begin, begin + length));
}

/// Of -coefficient*lap: cosines between walls, the shortest of which has 12 half waves; on the ring 6 whole ones.
double largest_rate() {
  const double h = 1.0 / cells, angle = std::numbers::pi * (cells - 1) / (2 * cells);
  return coefficient * 4 * std::pow(std::sin(angle) / h, 2);
}

double closed_form(const Case& c) {
  return c.second_order > 0 ? c.second_order / std::sqrt(largest_rate()) : c.first_order / largest_rate();
}

/// Adams and Bashforth's polynomials have -1 as a root at -1 and at -6/11 times the rate; of leapfrog dt*omega is 2, of
/// rk4 the largest rate times dt 2.7853.
TEST(OneMoment, LimitsAreTheSameInScenesOfAllLengths) {
  const std::vector<Case> cases{{"ab2", "dt(u) = 0.01*lap(u)", 1},
                                {"ab3", "dt(u) = 0.01*lap(u)", 6.0 / 11},
                                {"leapfrog", "dt(dt(u)) = 0.01*lap(u)", 0, 2},
                                {"rk4", "dt(u) = if(t < 5e-2, 0.01, 0.04)*lap(u)", 2.7853}};
  for (const Case& c : cases) {
    for (const bool is_ring : {false, true}) {
      for (const auto& [begin, length] : {std::pair{0.0, 1e-6}, {0.0, 1e-3}, {-2.0, 1e-5}, {-2.0, 1.0}}) {
        const std::unique_ptr<driver::Session> session = open_case(c, is_ring, begin, length);
        const StabilityReport verdict = verdict_of(*session);
        EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::limit);
        const double expected = closed_form(c);
        EXPECT_NEAR(verdict.limit.step, expected, 5e-3 * expected)
            << c.time << (is_ring ? ", ring, " : ", walls, ") << begin << " .. " << begin + length;
      }
    }
  }
}

TEST(OneMoment, RunsOfShortScenesHaveTheLimit) {
  const std::unique_ptr<driver::Session> session = open_case({"ab3", "dt(u) = 0.01*lap(u)", 6.0 / 11}, false, 0, 1e-5);
  const double limit = verdict_of(*session).limit.step;
  EXPECT_TRUE(try_step(*session, 0.97 * limit, {.steps = 2000})->is_stable);
  EXPECT_FALSE(try_step(*session, 1.04 * limit, {.steps = 2000})->is_stable);
}

}  // namespace
}  // namespace dpde::stability
