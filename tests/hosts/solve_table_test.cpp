// SPDX-License-Identifier: Apache-2.0
// Kinds of solves x methods x callers: what has no solution is a NoSolution to all of them, whichever solver has found
// that, with its step and its place in the text; searches take it for a step that was too long.
#include <cmath>

#include "dpde/runtime/unsolved.h"
#include "host_support.h"

namespace dpde::testing {
namespace {

struct Kind {
  const char *name, *model, *time, *fields;
  const char* code;
  int line;
};

/// The factor exp(k) is no number from k = 710 on: then no method solves anything.
const std::vector<Kind> kinds = {
    {"declared", "field u\n  solve psi - exp(k)*lap(psi) = u for psi\n  dt(u) = psi - u", "euler",
     "boundary psi: all = 0\n  boundary u: all = zero_gradient\n  initial u = sin(3*x)*y", "E0814", 3},
    {"stage", "field u\n  dt(u) = exp(k)*lap(u)", "backward_euler", "boundary u: all = 0\n  initial u = sin(3*x)*y",
     "E0814", 3},
    {"coupled", "field u, v\n  dt(u) = exp(k)*lap(u) + 0.1*v\n  dt(v) = lap(v) - 0.1*u",
     "backward_euler; implicit = all",
     "boundary u: all = 0\n  boundary v: all = 0\n  initial u = sin(3*x)*y\n  initial v = 0", "E0815", 3},
    {"newton", "field u\n  dt(u) = lap(u) - exp(k)*u^3", "backward_euler; implicit = all",
     "boundary u: all = 0\n  initial u = sin(3*x)*y", "E0815", 3},
};

std::string text_of(const Kind& kind, const std::string& scheme, const std::string& time, const std::string& k,
                    const std::string& optimiser) {
  return std::string("model m { param k\n  ") + kind.model + " }\nscheme c { time = " + scheme +
         " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 12\n  grid y = 0 .. 1, cells 10\n  k = " + k + "\n  " +
         kind.fields + "\n  time " + time + "\n}\ntask t : s {\n  unknown k\n  minimise mean(u^2)\n  using " +
         optimiser + "\n}\n";
}

template <class Call>
void expect_unsolved(const Call& call, const Kind& kind, const std::string& what) {
  SCOPED_TRACE(what);
  try {
    call();
    ADD_FAILURE() << "there is no solution";
  } catch (const NoSolution& error) {
    const auto* unsolved = dynamic_cast<const Unsolved*>(&error);
    ASSERT_NE(unsolved, nullptr) << error.what();
    EXPECT_EQ(unsolved->facts().step, 1) << error.what();
    EXPECT_EQ(unsolved->facts().t, 0);
    EXPECT_FALSE(unsolved->facts().method.empty() && unsolved->facts().text.find("not finite") == std::string::npos);
    EXPECT_NE(error.solve_for(), "");
    ASSERT_EQ(error.messages().size(), 1) << error.what();
    EXPECT_EQ(error.messages().front().code, kind.code) << error.what();
    EXPECT_EQ(error.messages().front().line, kind.line) << error.what();
  }
}

TEST(SolveTable, WhatHasNoSolutionIsSaidToEveryCaller) {
  for (const Kind& kind : kinds) {
    std::vector<std::string> methods = {"automatic"};
    if (kind.name == std::string("declared"))
      methods = {"automatic", "direct", "fourier", "multigrid", "cg", "bicgstab", "gmres"};
    for (const std::string& method : methods) {
      SCOPED_TRACE(std::string(kind.name) + " " + method);
      const std::string text = text_of(kind, std::string(kind.time) + "; solve = " + method, "0 .. 0.2, step 0.1", "0",
                                       "gradient_descent(rate = 1e9), iterations 5");
      Simulation sim = compile_text(text, {.name = "t", .certify = false, .second_order = true}, "table.dpde");
      const double loss = sim.gradient();
      EXPECT_TRUE(std::isfinite(loss));
      const Optimised found = sim.optimise();  // the first step is far too long
      EXPECT_EQ(found.reason, StopReason::not_finite);
      EXPECT_EQ(found.loss, loss);
      sim.set("k", 800);
      expect_unsolved([&] { sim.step(); }, kind, "step");
      expect_unsolved([&] { sim.reset(), sim.run(); }, kind, "run");
      expect_unsolved([&] { sim.loss(); }, kind, "loss");
      expect_unsolved([&] { sim.gradient(); }, kind, "gradient");
      expect_unsolved([&] { sim.hessian_vector(std::vector<double>{1}); }, kind, "product");
      expect_unsolved([&] { sim.optimise(); }, kind, "optimise, where it starts");
      sim.set("k", 0);  // nothing of that stays
      EXPECT_EQ(sim.gradient(), loss);
    }
  }
}

/// Parts by a Courant number or a tolerance are made shorter as long as that may help.
TEST(SolveTable, PartsOfStepsSayTheSame) {
  const Kind& kind = kinds.front();
  for (const auto& [scheme, time] :
       {std::pair<std::string, std::string>{"euler", "0 .. 0.2, step 0.1, courant 0.5, speed 3"},
        {"dopri5", "0 .. 0.2, step 0.1, tolerance 1e-6"}}) {
    for (const std::string method : {"direct", "cg"}) {
      Simulation sim = compile_text(text_of(kind, scheme + "; solve = " + method, time, "0", "lbfgs()"),
                                    {.name = "t", .certify = false}, "table.dpde");
      EXPECT_TRUE(std::isfinite(sim.gradient()));
      sim.set("k", 800);
      expect_unsolved([&] { sim.loss(); }, kind, scheme + " " + method);
      sim.set("k", 0);
      EXPECT_TRUE(std::isfinite(sim.loss()));
    }
  }
}

/// A line search that goes beyond k = 0, where the operator is definite no more, comes back.
TEST(SolveTable, SearchesComeBackFromWhereThereIsNoSolution) {
  const auto text = [](const std::string& method, const std::string& optimiser, bool declared) {
    const std::string model = declared ? "solve psi - k*lap(psi) = u for psi\n  dt(u) = psi - u" : "dt(u) = k*lap(u)";
    const std::string walls =
        declared ? "boundary psi: all = 0\n  boundary u: all = zero_gradient" : "boundary u: all = 0";
    return "model m { field u; param k\n  " + model +
           " }\nscheme c { time = " + (declared ? "euler" : "backward_euler") + "; solve = " + method +
           " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 12\n  grid y = 0 .. 1, cells 12\n  k = 0.001\n  " +
           walls +
           "\n  initial u = sin(3*x)*y\n  time 0 .. 0.5, step 0.1\n}\ntask t : s {\n  data seen = u from scene s\n"
           "  unknown k from 0.5\n  minimise mean((u - seen)^2)\n  using " +
           optimiser + ", iterations 20\n}\n";
  };
  for (const bool declared : {true, false}) {
    std::vector<std::string> methods = {"multigrid", "cg"};
    if (declared) methods = {"automatic", "direct", "multigrid", "cg", "bicgstab", "gmres"};
    for (const std::string& method : methods) {
      Simulation sim = compile_text(text(method, "lbfgs()", declared), {.name = "t", .certify = false}, "search.dpde");
      const Optimised found = sim.optimise();
      EXPECT_LT(found.loss, 1e-15) << method << " " << declared;
      EXPECT_NEAR(sim.param("k"), 0.001, 1e-6) << method << " " << declared;
    }
    if (!declared) continue;
    for (const std::string optimiser :
         {"newton_cg()", "newton_cg(hessian = gauss_newton)", "adam(rate = 0.3)", "gradient_descent(rate = 20)"}) {
      Simulation sim = compile_text(text("cg", optimiser, declared), {.name = "t", .certify = false}, "search.dpde");
      const Optimised found = sim.optimise();  // it may stop at what has no solution, but not die of it
      EXPECT_TRUE(std::isfinite(found.loss)) << optimiser << " " << declared;
    }
  }
}

}  // namespace
}  // namespace dpde::testing
