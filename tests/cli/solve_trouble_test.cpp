// SPDX-License-Identifier: Apache-2.0
// Messages about failing solves or open ends, with useful hints.
#include <regex>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using SolveTrouble = Command;

/// Flow between walls with an open end on the right.
std::string open_channel(const std::string& inflow, const std::string& more) {
  return "model flow {\n  vector u on faces\n  field p\n  param nu\n  mask solid\n"
         "  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)\n  0 = div(u) gives p\n  u = 0 inside solid\n}\n"
         "scene s : flow {\n  grid x = 0 .. 2, cells 32\n  grid y = 0 .. 1, cells 16\n  nu = 0.05\n  initial u = 0\n"
         "  boundary u.x: x.low = " +
         inflow +
         ", x.high = outflow, y = 0\n  boundary u.y: x.low = 0, x.high = outflow, y = 0\n"
         "  time 0 .. 0.4, step 0.01\n" +
         more + "\n}\n";
}

TEST_F(SolveTrouble, FlowThatComesInThroughAnOpenEndIsAWarning) {
  write("s.dpde", open_channel("y*(1 - y)", "  solid = 0 > 1"));
  const Outcome out = dpde("run s.dpde --json");
  EXPECT_EQ(out.status, 0) << out.err;
  EXPECT_TRUE(out.codes().empty()) << out.err;
  write("s.dpde", open_channel("sin(2*pi*y)", "  solid = 0 > 1"));
  const Outcome back = dpde("run s.dpde --json");
  EXPECT_EQ(back.status, 0) << back.err;
  EXPECT_EQ(back.codes(), std::vector<std::string>{"W0813"}) << back.err;
  EXPECT_NE(dpde("run s.dpde").err.find("on 8 of 16 faces"), std::string::npos);
}

TEST_F(SolveTrouble, OpenEndsAreCalledByTheirPlaces) {
  const auto turned = [&](const std::string& inflow) {
    std::string text = open_channel(inflow, "  solid = 0 > 1");
    const auto put = [&](const std::string& old, const std::string& now) {
      for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + now.size()))
        text.replace(at, old.size(), now);
    };
    put("grid x = 0 .. 2", "grid x = 2 .. 0");
    put("x.low", "x.in"), put("x.high", "x.low"), put("x.in", "x.high");
    write("s.dpde", text);
    return dpde("run s.dpde").err;
  };
  EXPECT_EQ(turned("-y*(1 - y)"), "");
  const std::string told = turned("-sin(2*pi*y)");
  EXPECT_NE(told.find("through the open end x.low"), std::string::npos) << told;
  EXPECT_NE(told.find("on 8 of 16 faces"), std::string::npos) << told;
}

TEST_F(SolveTrouble, RoomsThatObstaclesCutOffAreNamed) {
  const auto solve_of = [&](const std::string& solid) {
    write("s.dpde", open_channel("y*(1 - y)", "  solid = " + solid));
    const Outcome run = dpde("run s.dpde --set solve=cg");
    EXPECT_EQ(run.status, 0) << run.err;
    return run.out;
  };
  EXPECT_EQ(solve_of("(x - 1)^2 + (y - 0.5)^2 < 0.01").find("cut off"), std::string::npos);
  const std::string ring = "abs((x - 1)^2 + (y - 0.5)^2 - 0.06) < 0.025";
  EXPECT_NE(solve_of(ring).find("one room is cut off from the rest: there the mean is 0"), std::string::npos)
      << solve_of(ring);
}

/// A disc of coefficient 1e6 in cells with aspect ratio 100: cycles with coloured relaxation alone do not converge.
std::string jump(const std::string& solve) {
  return "model m {\n  field u\n  coefficient k\n  param a\n  solve div(k*grad(psi)) = u for psi\n  dt(u) = a*psi\n}\n"
         "scheme c { time = euler; solve = " +
         solve +
         "; smoother = red_black }\nscene s : m with c {\n  grid x = 0 .. 100, cells 128\n  grid y = 0 .. 1, cells "
         "128\n  a = 1\n"
         "  k = if((x/100 - 0.5)^2 + (y - 0.5)^2 < 1/16, 1e6, 1)\n  boundary psi: all = 0\n  boundary u: all = "
         "zero_gradient\n"
         "  initial u = 1 + sin(7*x*y)\n  time 0 .. 1e-3, step 1e-3\n}\n"
         "task t : s {\n  unknown initial u\n  minimise mean(u^2)\n}\n";
}

TEST_F(SolveTrouble, CyclesThatComeNoNearerAreToldWhatDoes) {
  write("s.dpde", jump("multigrid(1e-6, 60)"));
  const Outcome run = dpde("run s.dpde");
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("it does not converge: take cg"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("s.dpde:5:3: error[E0814]"), std::string::npos) << run.err;  // the equation
  const Outcome gradient = dpde("gradient s.dpde t");
  EXPECT_NE(gradient.err.find("s.dpde:5:3: error[E0814]"), std::string::npos) << gradient.err;
  const Outcome by_cg = dpde("run s.dpde --set 'solve=cg(1e-6, 60)'");
  EXPECT_EQ(by_cg.status, 0) << by_cg.err;
  const Outcome few = dpde("run s.dpde --set 'solve=cg(1e-6, 12)'");
  EXPECT_NE(few.err.find("are enough: solve = cg(1e-06, "), std::string::npos) << few.err;
  const Outcome check = dpde("check s.dpde s --json");  // the same message as from the run
  EXPECT_EQ(check.status, run.status);
  EXPECT_EQ(check.codes().back(), "E0814") << check.err;
}

/// Only c determines the mean of psi. Coefficients change in each step: the same solver continues in doubles.
TEST_F(SolveTrouble, WhatIsSolvedInDoublesAfterAllIsSaidSo) {
  write("s.dpde",
        "model m { field u, k; param c; solve div(k*grad(psi)) - c*psi = -(u + 1) for psi\n"
        "  dt(u) = psi*c - 0.1*u; dt(k) = 0.1*k }\n"
        "scheme s { time = euler; solve = multigrid(1e-5); real = f32 }\n"
        "scene p : m with s { grid x = 0 .. 1, cells 40; grid y = 0 .. 1, cells 44\n"
        "  boundary psi: all = zero_gradient; boundary u: all = zero_gradient; boundary k: all = zero_gradient\n"
        "  c = 1; initial u = sin(7*x) + cos(9*y*x); initial k = 1 + x*0.5; time 0 .. 1, step 0.1 }\n");
  const std::string in_floats = "multigrid cycles in f32, ", in_doubles = "multigrid cycles, ";
  for (const bool is_held : {true, false}) {
    const Outcome run = dpde(is_held ? "run s.dpde --force" : "run s.dpde --force --set c=1e-6");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(run.out.find(in_floats) != std::string::npos, is_held) << run.out;
    EXPECT_EQ(run.out.find(in_doubles) != std::string::npos, !is_held) << run.out;
  }
}

/// Equations of the text, in the step or only in observables, and stages of implicit schemes, linear or not.
TEST_F(SolveTrouble, ChecksSayWhatTheFirstStepOfTheRunSays) {
  struct Row {
    std::string model, scheme, code, shown = "";
  };
  const std::string apart = "dt(u) = lap(u)\n  solve lap(psi) - psi = -u for psi",
                    loose = "euler; solve = cg(1e-10, 2)";
  for (const auto& [model, scheme, code, shown] : std::vector<Row>{
           {apart, loose, "E0814", "observe e = integral(psi)"},
           {"dt(u) = lap(u) + 30*u^2", "backward_euler; implicit = all", "E0815"},
           {"dt(u) = lap(u)", "backward_euler; solve = cg(1e-10, 2)", "E0814"},
           {"dt(u) = div(k*grad(u))", "crank_nicolson; solve = cg(1e-10, 2)", "E0814"},
           {"solve lap(psi) - psi = -u for psi\n  dt(u) = psi + lap(u)", "euler; solve = cg(1e-10, 2)", "E0814"}}) {
    const bool has_psi = model.find("psi") != std::string::npos;
    write("s.dpde", "model m {\n  field u; coefficient k\n  " + model + "\n}\nscheme c { time = " + scheme +
                        " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 24; grid y = 0 .. 1, cells 20\n" +
                        (has_psi ? "  boundary psi: all = 0\n" : "") +
                        "  boundary u: all = 0\n  k = 1 + x\n  initial u = 1 + x*y; time 0 .. 4, step 1\n  " + shown +
                        "\n}\n");
    const Outcome run = dpde("run s.dpde s --force --json"), check = dpde("check s.dpde s --json");
    EXPECT_NE(run.status, 0) << model;
    EXPECT_EQ(check.status, run.status) << model << check.err;
    ASSERT_FALSE(run.codes().empty() || check.codes().empty()) << model;
    EXPECT_EQ(run.codes().back(), code) << model << run.err;
    EXPECT_EQ(check.codes().back(), code) << model << check.err;
    for (const char* const what : {"line", "message"})
      EXPECT_EQ(check.json()["diagnostics"].back()[what], run.json()["diagnostics"].back()[what]) << model;
  }
}

/// Runs without --out write nothing, and are right.
TEST_F(SolveTrouble, ChecksSayWhatIsNotSolvedForOutputs) {
  write("s.dpde",
        "model m {\n  field u\n  dt(u) = lap(u)\n  solve lap(psi) - psi = -u for psi\n}\n"
        "scheme c { time = euler; solve = cg(1e-10, 2) }\nscene s : m with c {\n  grid x = 0 .. 1, cells 24; grid y = "
        "0 .. 1, cells 20\n"
        "  boundary psi: all = 0; boundary u: all = 0\n  initial u = 1 + x*y; time 0 .. 4, step 1\n  output psi every "
        "1\n}\n");
  const Outcome check = dpde("check s.dpde --all s");
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_NE(check.out.find("with --out: solve for psi"), std::string::npos) << check.out;
  EXPECT_EQ(dpde("run s.dpde s --force").status, 0);
  EXPECT_EQ(dpde("run s.dpde s --force --json --out o").codes().back(), "E0814");
}

TEST_F(SolveTrouble, GradientsOfLooseSolvesSayWhoMeasuresThem) {
  write("s.dpde", jump("cg(1e-2)"));
  const Outcome loose = dpde("gradient s.dpde t");
  EXPECT_EQ(loose.status, 0) << loose.err;
  EXPECT_NE(loose.out.find("solves to 1e-02 of their right sides leave an error in the gradient"), std::string::npos)
      << loose.out;
  const Outcome tight = dpde("gradient s.dpde t --set 'solve=cg(1e-9)'");
  EXPECT_EQ(tight.out.find("leave an error"), std::string::npos) << tight.out;
}

/// Plain iterations with a loose tolerance give a difference between tangent and adjoint that is not an error of dpde.
TEST_F(SolveTrouble, LooseSolvesAreCertifiedByTightOnes) {
  write("s.dpde",
        "model m { field w; param e = 1; solve lap(psi) - e*psi = -w for psi; dt(w) = 0.2*psi - 0.1*w }\n"
        "scheme loose { solve = cg(1e-4); preconditioner = none; guess = extrapolate }\nscene s : m with loose {\n"
        "  grid x = 0 .. 1, cells 24; grid y = 0 .. 1, cells 20\n"
        "  boundary psi: all = 0; boundary w: all = zero_gradient\n"
        "  initial w = 1 + sin(5*x)*cos(3*y); time 0 .. 0.3, step 0.1 }\n"
        "task g : s { unknown e; unknown initial w; minimise mean(psi^2) }\n");
  const Outcome gradient = dpde("gradient s.dpde g --certify");
  EXPECT_EQ(gradient.status, 0) << gradient.err;
  EXPECT_NE(gradient.out.find("its solves stop before they come to rounding"), std::string::npos) << gradient.out;
  const Outcome verify = dpde("verify s.dpde g");
  EXPECT_EQ(verify.status, 0) << verify.out;
  EXPECT_NE(verify.out.find("the certificate is of solves to 1e-12"), std::string::npos) << verify.out;
}

/// Solves stopped early with `warn` are not an error of dpde: certificates and verify report the residuals.
TEST_F(SolveTrouble, SolvesThatWereStoppedEarlyAreNotBlamed) {
  write("s.dpde",
        "model m { field w; coefficient k; param e = 1\n"
        "  solve div((1 + e*k)*grad(psi)) - advect((2, 1), psi) - psi = -w for psi; dt(w) = 0.2*psi - 0.1*w }\n"
        "scheme few { solve = gmres(1e-12, 2, warn); time = euler; guess = none }\nscene s : m with few {\n"
        "  grid x = 0 .. 1, cells 12; grid y = 0 .. 1, cells 10\n"
        "  k = 100*if(abs(x - 0.5) < 0.2 and abs(y - 0.4) < 0.2, 1, 0)\n"
        "  boundary psi: all = 0; boundary w: all = zero_gradient\n  initial w = 1 + x; time 0 .. 0.2, step 0.1 }\n"
        "task g : s { unknown e; minimise mean(psi^2) }\n");
  const Outcome gradient = dpde("gradient s.dpde g --certify");
  EXPECT_EQ(gradient.status, 0) << gradient.err;
  EXPECT_EQ(gradient.err.find("bug of dpde"), std::string::npos) << gradient.err;
  EXPECT_NE(gradient.err.find("W0809"), std::string::npos) << gradient.err;
  EXPECT_NE(gradient.out.find("its solves stop before they come to rounding"), std::string::npos) << gradient.out;
  EXPECT_NE(gradient.out.find("solves that were stopped early, with up to"), std::string::npos) << gradient.out;
  if (!is_thorough()) return;
  const Outcome verify = dpde("verify s.dpde g");
  EXPECT_EQ(verify.out.find("solves: to 1e-12"), std::string::npos) << verify.out;
  EXPECT_NE(verify.out.find("solves: stopped early, with up to"), std::string::npos) << verify.out;
  EXPECT_NE(verify.err.find("solves were stopped early, as warn says"), std::string::npos) << verify.err;
}

/// Methods named in hints: "take cg, gmres or direct" and "solve = cg(1e-09, 30)".
std::vector<std::string> advised(const std::string& text) {
  std::vector<std::string> found;
  static const std::regex with_numbers("solve = (\\w+\\([^)]*\\))"), by_name("take ([a-z, ]+)"), method("[a-z]+");
  std::smatch match;
  if (std::regex_search(text, match, with_numbers)) found.push_back(match[1]);
  if (!std::regex_search(text, match, by_name)) return found;
  const std::string names = match[1];
  for (std::sregex_iterator name(names.begin(), names.end(), method), end; name != end; ++name) {
    if (name->str() != "or") found.push_back(name->str());
  }
  return found;
}

/// A warning's suggestions solve this very system: each of them is tried.
TEST_F(SolveTrouble, WhatAWarningAdvisesSolvesTheSystem) {
  const auto text = [](const std::string& operation, const std::string& solve) {
    return "model m { field w; solve " + operation + " = -w for psi; dt(w) = 0.2*psi }\nscheme few { solve = " + solve +
           "; time = euler; guess = none }\nscene s : m with few {\n  grid x = 0 .. 1, cells 24; grid y = 0 .. 1, "
           "cells 20\n  boundary psi: all = 0; boundary w: all = zero_gradient\n  initial w = 1 + x*y; time 0 .. "
           "0.1, step 0.1 }\n";
  };
  for (const std::string operation : {"lap(psi)", "lap(psi) - advect((20, 10), psi)"}) {
    for (const std::string solve : {"gmres(1e-9, 2, warn)", "bicgstab(1e-9, 2, warn)"}) {
      write("s.dpde", text(operation, solve));
      const Outcome warned = dpde("run s.dpde --json");
      EXPECT_EQ(warned.codes(), std::vector<std::string>{"W0809"}) << warned.err;
      const std::vector<std::string> methods = advised(warned.json()["diagnostics"][0]["hint"]);
      EXPECT_FALSE(methods.empty()) << warned.err;
      for (const std::string& method : methods) {
        write("s.dpde", text(operation, method));
        const Outcome solved = dpde("run s.dpde --json");
        EXPECT_EQ(solved.status, 0) << operation << solve << method << solved.err;
        EXPECT_TRUE(solved.codes().empty()) << operation << solve << method << solved.err;
      }
    }
  }
}

/// On the narrow grids of verify the obstacle may close the channel. The operator of p vanishes there.
TEST_F(SolveTrouble, VerifyTakesChannelsThatAnObstacleCloses) {
  write("s.dpde",
        "model wake { vector u on faces; field p; mask solid; param nu = 0.05\n"
        "  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)\n  0 = div(u) gives p\n  u = 0 inside solid }\n"
        "scheme book { advect = semi_lagrangian; time = euler }\nscene s : wake with book {\n"
        "  grid x = 0 .. 100, cells 8\n  grid y = 0 .. 200, cells 16\n  solid = (x - 50)^2 + (y - 50)^2 < 100\n"
        "  boundary u.x: x = 0, y.low = 0, y.high = outflow\n"
        "  boundary u.y: x = zero_gradient, y.low = 1, y.high = outflow\n  initial u = (0, 1)\n"
        "  time 0 .. 4, step 1 }\ntask t : s { unknown nu; minimise mean(u.x^2) }\n");
  const Outcome verify = dpde("verify s.dpde t");
  EXPECT_EQ(verify.status, 0) << verify.err;
  EXPECT_NE(verify.out.find("certified"), std::string::npos) << verify.out;
  EXPECT_EQ(verify.out.find("NOT certified"), std::string::npos) << verify.out;
}

/// From u = 0 the forward solve is trivial; for the adjoint solve two iterations of cg are far from enough.
TEST_F(SolveTrouble, TransposedSolvesThatMissAreTold) {
  write("s.dpde",
        "model m { field u; coefficient w; param a; solve lap(psi) = u for psi; dt(u) = a*psi }\n"
        "scheme c { time = euler; solve = cg(1e-9, 2, warn) }\nscene s : m with c {\n  grid x = 0 .. 1, cells 32\n"
        "  grid y = 0 .. 1, cells 32\n  a = 1\n  w = exp(sin(40*x*y) + 3*x)\n  boundary psi: all = 0\n"
        "  boundary u: all = zero_gradient\n  initial u = 0\n  time 0 .. 5e-3, step 1e-3\n}\n"
        "task t : s { unknown initial u; minimise mean(w*u) }\n");
  const Outcome gradient = dpde("gradient s.dpde t --json");
  const std::vector<std::string> codes = gradient.codes();
  EXPECT_NE(std::ranges::find(codes, "W0809"), codes.end()) << gradient.err;
  EXPECT_NE(gradient.err.find("the adjoint of psi"), std::string::npos) << gradient.err;
}

/// Between walls with slopes lap(psi) - b*dx(psi) maps constants to 0 and is unsymmetric: its range depends on b, so
/// the derivative of the least-squares solution has an additional term. There is none if it is symmetric, or if the
/// right-hand side is in the range.
TEST_F(SolveTrouble, LeastSquaresHaveNoGradient) {
  const auto text = [](const std::string& b, const std::string& u) {
    return "model m { field u; param b\n  solve lap(psi) - b*dx(psi) = u for psi\n  dt(u) = psi }\nscene s : m {\n"
           "  grid x = 0 .. 1, cells 12\n  b = " +
           b + "\n  initial u = " + u +
           "\n  boundary u: x = zero_gradient\n"
           "  boundary psi: x = zero_gradient\n  observe size = mean(psi^2)\n  time 0 .. 0.1, step 0.05\n}\n"
           "task t : s { unknown initial u; minimise mean(psi^2) }\n";
  };
  write("s.dpde", text("3", "x"));
  EXPECT_EQ(dpde("run s.dpde s --json").codes(), std::vector<std::string>{"W0810"});
  for (const char* command : {"gradient s.dpde t --json --no-certify", "optimize s.dpde t --json --no-certify"}) {
    const Outcome refused = dpde(command);
    EXPECT_NE(refused.status, 0);
    EXPECT_NE(refused.err.find("least squares"), std::string::npos) << refused.err;
  }
  write("s.dpde", text("0", "x"));
  EXPECT_EQ(dpde("gradient s.dpde t --no-certify").status, 0);
  std::string of_loss = text("3", "x");  // solved in the loss only
  of_loss.replace(of_loss.find("dt(u) = psi"), 11, "dt(u) = 0");
  write("s.dpde", of_loss);
  EXPECT_NE(dpde("gradient s.dpde t --no-certify").err.find("least squares"), std::string::npos);
}

/// lap(psi) - k*psi is singular only for k = 0: for a right-hand side with a mean psi grows like 1/k there. Right-hand
/// sides without a mean are solved as for other k, and psi has a derivative by the right-hand side.
TEST_F(SolveTrouble, WhereAnOperatorIsSingularForOneValueThereIsNoDerivativeByIt) {
  const auto text = [](const std::string& equation, const std::string& right, const std::string& unknown) {
    return "model m { field u; param k; coefficient f\n  solve " + equation +
           " = f for psi\n  dt(u) = psi }\nscene s : m {\n"
           "  grid x = 0 .. 1, cells 12, periodic\n  k = 0\n  f = " +
           right +
           "\n  initial u = 0\n"
           "  time 0 .. 0.1, step 0.05\n}\ntask t : s { unknown " +
           unknown + "; minimise mean(u^2) }\n";
  };
  struct Row {
    std::string equation, right, unknown;
    bool is_refused, is_warned;
  };
  for (const auto& [equation, right, unknown, is_refused, is_warned] :
       std::vector<Row>{{"lap(psi) - k*psi", "sin(2*pi*x) + 0.3", "k", true, false},
                        {"lap(psi) - k*psi", "sin(2*pi*x) + 0.3", "f", false, true},
                        {"lap(psi) - k*psi", "sin(2*pi*x)", "k", false, false},
                        {"div((1 + k)*grad(psi))", "sin(2*pi*x) + 0.3", "k", false, true}}) {
    write("s.dpde", text(equation, right, unknown));
    for (const std::string verb : {"gradient", "optimize"}) {
      const Outcome outcome = dpde(verb + " s.dpde t --no-certify");
      const std::string what = verb + " of " + equation + " by " + unknown + ": " + outcome.err;
      EXPECT_EQ(outcome.status == 1, is_refused) << what;
      EXPECT_EQ(outcome.err.find("there is no derivative by k") != std::string::npos, is_refused) << what;
      if (verb == "gradient") EXPECT_EQ(outcome.err.find("W0810") != std::string::npos, is_warned) << what;
    }
  }
}

/// A system that is singular on the few cells of a check, due to a conductivity of both signs, but not on the scene's.
TEST_F(SolveTrouble, OfAFewCellsIsNotTheScenes) {
  write("s.dpde",
        "model m { field u; coefficient k; solve div(k*grad(psi)) = u for psi; dt(u) = psi - u }\nscene s : m {\n"
        "  grid x = 0 .. 1, cells 16\n  k = x - 0.5\n  initial u = 1\n  boundary psi: all = 0\n"
        "  boundary u: all = zero_gradient\n  observe size = mean(psi^2)\n  time 0 .. 0.1, step 0.1\n}\n");
  const Outcome run = dpde("run s.dpde s --json --force"),
                other = dpde("run s.dpde s --json --force --set solve=bicgstab");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NEAR(run.json()["observables"]["size"].get<double>(), other.json()["observables"]["size"].get<double>(), 1e-9);
}

/// Gradients and searches give the same warnings as `run`.
TEST_F(SolveTrouble, GradientsWarnOfMissedConstraintsAndBackFlow) {
  const auto text = [](const std::string& sides) {
    return "model m { vector u on faces; field p; param nu; dt(u) = -advect(u, u) - grad(p) + nu*lap(u)\n"
           "  0 = div(u) gives p }\nscene s : m {\n  grid x = 0 .. 2, cells 16\n  grid y = 0 .. 1, cells 8\n  nu = "
           "0.05\n"
           "  initial u = 0\n" +
           sides +
           "  time 0 .. 1, step 0.01\n}\n"
           "task t : s { unknown nu in 0.05 .. 0.0501; minimise mean(u.x^2); using lbfgs, iterations 1 }\n";
  };
  write("miss.dpde",
        text("  boundary u.x: x.low = 4*y*(1 - y), x.high = 3*y*(1 - y), y = 0\n  boundary u.y: x = 0, y = 0\n"));
  write("back.dpde", text("  boundary u.x: x.low = 4*y*(1 - y), x.high = outflow, y.low = 0, y.high = outflow\n"
                          "  boundary u.y: x.low = 0, x.high = outflow, y.low = 0, y.high = outflow\n"));
  for (const auto& [file, code] : {std::pair{"miss", "W0807"}, {"back", "W0813"}}) {
    for (const std::string command : {"run", "gradient", "optimize"}) {
      if (command == "gradient" && !is_thorough()) continue;
      const std::vector<std::string> codes = dpde(command + " " + file + ".dpde --json").codes();
      EXPECT_NE(std::ranges::find(codes, code), codes.end()) << command << " " << file;
    }
  }
}

/// At a state far from rest the gradient would be that of a steady state: the change of the loss reveals this.
TEST_F(SolveTrouble, RunsUntilSteadyThatStopEarlyAreTold) {
  const auto loss_at = [&](const std::string& steady, std::vector<std::string>* codes, double* change) {
    write("s.dpde",
          "model m { field u; param k; dt(u) = k*lap(u) - 2*u^3 + 1 }\nscene s : m {\n  grid x = 0 .. 1, cells 12\n"
          "  k = 0.1\n  initial u = 0\n  boundary u: x = 0\n  time 0 .. 100, step 0.01, until steady " +
              steady + "\n}\ntask t : s { unknown k; minimise mean(u^2) }\n");
    const Outcome run = dpde("gradient s.dpde t --json --no-certify");
    *codes = run.codes();
    *change = run.json()["steady"]["loss_change"].get<double>();
    return run.json()["loss"].get<double>();
  };
  std::vector<std::string> codes;
  double change = 0;
  const double at_rest = loss_at("1e-10", &codes, &change);
  EXPECT_TRUE(codes.empty());
  EXPECT_LT(std::abs(change), 1e-8);
  const double early = loss_at("0.01", &codes, &change);
  EXPECT_EQ(codes, std::vector<std::string>{"W0820"});
  EXPECT_NEAR(change, at_rest - early, 0.1 * std::abs(change));
  EXPECT_NE(dpde("verify s.dpde t").err.find("W0814"), std::string::npos);
}

/// For each unknown separately, independent of the units of states, in single precision, if only the loss is reported,
/// for any step; not if a gradient is 0 up to rounding.
TEST_F(SolveTrouble, GradientsOfStatesThatMoveAreTold) {
  const auto codes_of = [&](const std::string& model, const std::string& scene, const std::string& task,
                            const std::string& settings = "") {
    write("s.dpde", "model m { " + model + " }\nscheme c { time = rk4 }\nscene s : m with c { " + scene +
                        " }\ntask t : s { " + task + " }\n");
    return dpde("gradient s.dpde t --json --force --no-certify" + settings).codes();
  };
  const std::vector<std::string> of_loss{"W0814"}, of_gradient{"W0820"};
  const std::string two = "field u, v; param k = 1, a = 1; dt(u) = k - u*abs(u); dt(v) = 0.02*(a - v^3)";
  const std::string rest = "initial u = 1; initial v = 0.5; time 0 .. 400, step 1/16, until steady 5e-3";
  EXPECT_EQ(codes_of(two, rest, "unknown k; unknown a; minimise mean(1e4*u + v^2)"), of_gradient);
  EXPECT_EQ(codes_of(two, rest, "unknown k; minimise mean(u)"), std::vector<std::string>());
  const std::string units = "field u, p; param k = 0.1; dt(u) = k*lap(u) + 2*x*(1 - x) - u; dt(p) = 1e8 - p";
  const std::string edge =
      "grid x = 0 .. 1, cells 16; initial u = sin(3*x); initial p = 1e8; boundary p: x = "
      "zero_gradient; boundary u: x.low = 0, x.high = zero_gradient; time 0 .. 100, step 0.01, "
      "until steady 1e-6";
  EXPECT_EQ(codes_of(units, edge, "unknown k from 0.27168; minimise mean((u - 0.1)^2)"), of_gradient);
  const std::string cubic = "field u; param k = 0.1; dt(u) = k*lap(u) + sin(pi*x) - u^3";
  const std::string coarse =
      "grid x = 0 .. 1, cells 16; boundary u: x = 0; initial u = 0; time 0 .. 40, step 1/64, "
      "until steady 1e-1";
  for (const char* const step : {"1/64", "1/1024"}) {
    const std::string set = std::string(" --set step=") + step;
    EXPECT_EQ(codes_of(cubic, coarse, "unknown k; minimise mean(u^2)", set), of_gradient) << step;
    const std::vector<std::string> single =
        codes_of(cubic, coarse, "unknown k; minimise mean(u^2)", set + " --set real=f32");
    EXPECT_TRUE(single == of_loss || single == of_gradient) << step;
  }
  const std::string flat = "field u; param k = 0.1; dt(u) = k*lap(u) + u - u^3";
  const std::string walls =
      "grid x = 0 .. 1, cells 16; initial u = 0.5*sin(3*x); boundary u: x = zero_gradient; "
      "time 0 .. 100, step 0.005, until steady 1e-9";
  EXPECT_EQ(codes_of(flat, walls, "unknown k; minimise mean((u - 0.1)^2)"), std::vector<std::string>());
}

/// With the longest stable step the shortest wave hardly changes per step although it is far from rest, which the loss
/// does not see: its derivative by k is not small.
TEST_F(SolveTrouble, GradientsOfWavesThatHardlyMoveAreTold) {
  const auto gradient_at = [&](const std::string& k, const std::string& command, std::vector<std::string>* codes) {
    write("s.dpde",
          "model m { field u; param k = 0.1; dt(u) = k*lap(u) + 2*x*(1 - x) - u }\nscheme rk { time = rk4 }\n"
          "scene s : m with rk {\n  grid x = 0 .. 1, cells 16\n  initial u = sin(3*x)\n"
          "  boundary u: x.low = 0, x.high = zero_gradient\n  time 0 .. 100, step 0.01, until steady 1e-6\n}\n"
          "task t : s { unknown k from " +
              k + "; minimise mean((u - 0.1)^2); using lbfgs(), iterations 2 }\n");
    const Outcome run = dpde(command + " s.dpde t --json --force --no-certify");
    *codes = run.codes();
    return command == "gradient" ? run.json()["gradient"]["k"]["value"].get<double>() : 0.0;
  };
  std::vector<std::string> codes;
  EXPECT_NEAR(gradient_at("0.271", "gradient", &codes), -0.05398, 1e-4);
  EXPECT_TRUE(codes.empty());
  EXPECT_GT(gradient_at("0.27168", "gradient", &codes), 1);  // in the steady state it is -0.054
  EXPECT_EQ(codes, std::vector<std::string>{"W0820"});
  gradient_at("0.27168", "optimize", &codes);
  EXPECT_NE(std::ranges::find(codes, "W0820"), codes.end());
  const Outcome verify = dpde("verify s.dpde t");
  EXPECT_NE(verify.err.find("E0804"), std::string::npos) << verify.out;
  EXPECT_NE(verify.err.find("(until steady 1e-09)"), std::string::npos) << verify.err;
}

}  // namespace
}  // namespace dpde::testing
