// SPDX-License-Identifier: Apache-2.0
// Steps whose solves fail: the verdict reports that and no growth, and the run reports the position.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "dpde/runtime/unsolved.h"
#include "stability/stability_report.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

struct Unsolvable {
  const char *operator_of_p, *method, *said;
  const char* said_by_verdict = said;
};

/// The runs of what cannot be looked at as waves are of the whole grid, and solve as the scene does: for means that
/// masks cut out, and around a pole.
std::string with_means(const Unsolvable& of, const std::string& time) {
  return fmt::format(
      "model m {{ field u; mask q\n solve {} = u for p\n dt(u) = p - u + 0.1*mean(q*u)*q }}\n"
      "scheme a {{ time = {}; solve = {} }}\n"
      "scene s : m with a {{ grid x = 0 .. 1, cells 24\n grid y = 0 .. 1, cells 20\n q = x < 0.5\n"
      " boundary p: all = 0\n boundary u: all = zero_gradient\n initial u = sin(3*x)*y\n"
      " time 0 .. 0.4, step 0.1 }}\n",
      of.operator_of_p, time, of.method);
}
std::string around_a_pole(const Unsolvable& of, const std::string& time) {
  return fmt::format(
      "model m {{ field u\n solve {} = u for p\n dt(u) = p - u }}\nscheme a {{ time = {}; solve = {} }}\n"
      "scene s : m with a {{ coordinates polar\n grid r = 0 .. 1, cells 20\n"
      " grid theta = 0 .. 2*pi, cells 24, periodic\n boundary p: r.low = pole, r.high = 0\n"
      " boundary u: r.low = pole, r.high = zero_gradient\n initial u = r*cos(theta)\n time 0 .. 0.4, step 0.1 }}\n",
      of.operator_of_p, time, of.method);
}

void expect_that_it_is_said(const std::string& text, const Unsolvable& of) {
  SCOPED_TRACE(text);
  const auto session = open_scene(text);
  const StabilityReport verdict = verdict_of(*session);
  EXPECT_FALSE(verdict.is_analysed());
  EXPECT_NE(verdict.why.find(of.said_by_verdict), std::string::npos) << verdict.why;
  DiagnosticSink sink;
  EXPECT_TRUE(check_step(*session, false, sink));
  for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message;
  try {
    session->rollout().run();
    ADD_FAILURE() << "a run finds a solution";
  } catch (const Unsolved& error) {
    EXPECT_NE(std::string(error.what()).find(of.said), std::string::npos) << error.what();
    EXPECT_EQ(error.facts().step, 1);
    EXPECT_EQ(error.facts().t, 0);
  }
}

TEST(UnsolvedVerdict, SaysWhatASolveSays) {
  constexpr Unsolvable cases[] = {
      {"p - lap(p) + 20*dx(p)", "cg", "the method cg does not fit"},
      {"p - lap(p) + 20*dx(p)", "multigrid", "the method multigrid does not fit"},
      {"p - div((1 + u*u)*grad(p))", "fourier", "the method fourier does not fit", "is not known at the initial state"},
      {"p - lap(p)", "tridiagonal", "the method tridiagonal does not fit"},
      {"p - 0.01*lap(p)", "cg(1e-14, 1)", "iteration"},
  };
  for (const Unsolvable& one : cases) {
    for (const char* time : {"euler", "rk4"}) expect_that_it_is_said(with_means(one, time), one);
    if (std::string(one.operator_of_p).find("dx") == std::string::npos)
      expect_that_it_is_said(around_a_pole(one, "rk2"), one);
  }
}

}  // namespace
}  // namespace dpde::stability
