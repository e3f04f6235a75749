// SPDX-License-Identifier: Apache-2.0
// Events against closed forms, and against the same change written in the equation.
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// Two fields that grow from 0 with slopes 1 and 2, which the time scheme integrates exactly.
std::string growing(const std::string& events, const std::string& scheme = "time = rk4") {
  return "model m {\n  field a, b\n  dt(a) = 1\n  dt(b) = 2\n}\nscheme s { " + scheme +
         " }\nscene grow : m with s {\n  grid x = 0 .. 1, cells 3\n  boundary a = 0\n  boundary b = 0\n  initial a = "
         "0\n  initial b = 0\n"
         "  time 0 .. 1, step 1/16\n  " +
         events + "\n}\n";
}

std::vector<double> ends(const std::string& events, const std::string& scheme = "time = rk4") {
  const SceneResult result = run_scene(growing(events, scheme), "grow");
  if (result.state.empty()) return {};
  return {result.state.at("a")[1], result.state.at("b")[1]};
}

void expect_ends(const std::string& events, double a, double b) {
  for (const std::string scheme : {"time = euler", "time = rk2", "time = rk4", "time = ssp_rk3"}) {
    const std::vector<double> found = ends(events, scheme);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NEAR(found[0], a, 1e-12) << events << " " << scheme;
    EXPECT_NEAR(found[1], b, 1e-12) << events << " " << scheme;
  }
}

TEST(Event, HappensAfterEachStep) {
  expect_ends("after step: a += 0.5", 1 + 16 * 0.5, 2);
  expect_ends("after step: a = t, b = x", 1, 0.5);  // t is the end of the step
}

TEST(Event, HappensAtMultiplesOfAnInterval) {
  expect_ends("every 0.75: a = 0", 0.25, 2);
  expect_ends("every 1/4: a = 0, b += 10", 0, 42);
  expect_ends("every 1/16: b = 7", 1, 7);
}

TEST(Event, HappensAtTimes) {
  expect_ends("at t = 0.5: b = 0", 1, 1);
  expect_ends("at t = 0.25, 0.5, 1: b += 1", 1, 5);
  expect_ends("at t = 1/16: a = 0", 15. / 16, 2);
}

TEST(Event, UpdatesSeeTheValuesBeforeAndLaterEventsThoseBehind) {
  expect_ends("at t = 1: a = b, b = a", 2, 1);
  expect_ends("at t = 1: a = b\n  at t = 1: b = 10*a", 2, 20);
}

TEST(Event, CountsFromTheBeginOfTheRun) {
  std::string text = growing("every 0.75: a = 0");
  text.replace(text.find("0 .. 1, step"), 6, "5 .. 6");
  EXPECT_NEAR(run_scene(text, "grow").state.at("a")[0], 0.25, 1e-12);
}

/// Diffusion as an event that reads neighbours equals an Euler step, for all boundaries.
TEST(Event, ReadsNeighboursAndBoundaries) {
  for (const std::string cells : {"1", "2", "3", "20"}) {
    const std::string rest = "scene s : m with c {\n  grid x = 0 .. 1, cells " + cells +
                             "\n  grid y = 0 .. 1, cells 4, periodic\n" +
                             "  boundary u: x.low = 1 + t, x.high = gradient(sin(y))\n  initial u = cos(x + y)\n  time "
                             "0 .. 1/8, step 1/512\n";
    const std::string as_event =
        "model m { field u; dt(u) = 0 }\nscheme c { time = euler }\n" + rest + "  after step: u += lap(u)/5120\n}\n";
    const std::string as_equation =
        "model m { field u; dt(u) = lap(u)/10 }\nscheme c { time = euler }\n" + rest + "}\n";
    // the event acts at the end of its step, so its boundary values are one step later: shifted back
    std::string shifted = as_event;
    shifted.replace(shifted.find("1 + t,"), 6, "1 + t - 1/512,");
    const std::vector<double> event = run_scene(shifted, "s").state.at("u"),
                              equation = run_scene(as_equation, "s").state.at("u");
    for (std::size_t i = 0; i < event.size(); ++i) EXPECT_NEAR(event[i], equation[i], 1e-13) << cells;
  }
}

TEST(Event, DerivativesAreCertified) {
  const std::string text =
      "model m {\n  field u, v\n  param nu, q\n  dt(u) = -u*dx(u) + nu*lap(u) + v\n  dt(v) = q*u*v\n}\n"
      "scheme c { time = rk2 }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 12\n  boundary u: x.low = sin(t), x.high = zero_gradient\n  "
      "boundary v = zero_gradient\n"
      "  nu = 0.01\n  q = 0.3\n  initial u = sin(3*x)\n  initial v = x\n  time 0 .. 0.5, step 1/32\n"
      "  every 1/8: u = u*v + q, v += 0.1*u^2\n  after step: v += q*lap(v)*u/3200\n  at t = 0.25: u = u + "
      "0.01*dx(u*v)\n}\n"
      "task t : s {\n  unknown initial u\n  unknown initial v\n  unknown q from 0.4\n  minimise mean(u^2 + v^3)\n}\n";
  expect_certified(text, false);
}

/// b is overwritten by known values: its previous value is not read, and its adjoint is 0.
TEST(Event, AStateThatIsOverwrittenWithWhatIsKnown) {
  expect_certified(
      "model m {\n  field a, b\n  param k\n  dt(a) = 0\n  dt(b) = 0\n}\nscheme c { time = euler }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 8, periodic\n  k = 1\n  initial a = 0\n  initial b = 0\n  time 0 "
      ".. 1, step 1/2\n"
      "  after step: a = k*x, b = x^2\n}\n"
      "task t : s {\n  unknown k from 2\n  minimise mean((a - b)^2)\n}\n",
      true);
}

}  // namespace
}  // namespace dpde::testing
