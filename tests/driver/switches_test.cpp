// SPDX-License-Identifier: Apache-2.0
// Unknowns that move switches: in each kind of formula of a problem, of each kind, with continuous and discontinuous
// branches.
#include "driver/compile/switches.h"

#include "driver/driver_support.h"

namespace dpde::testing {
namespace {

/// Formulas of a problem; all others are smooth.
struct Slots {
  std::string declarations, rate = "-u + 0.1*c*f", held = "", items = "", initial = "1 + x/8", coefficient = "2 + x/8",
                            control = "0.3*t", event = "u", loss = "u^2", unknowns = "unknown a;";
};

std::string text_of(const Slots& s) {
  return s.declarations + "\nnetwork n(q) { initial he, seed 1; conv 4, 3; tanh; conv 1, 3 }\n" +
         "model m { field u, v; param a = 0.4, b = 0.7; coefficient c; control field f; mask wall\n" + s.held +
         "\n dt(u) = " + s.rate + "\n dt(v) = 0.1*lap(u) - v + 0.01*a + 0.01*b\n}\nscene s : m {\n" +
         " grid x = 0 .. 8, cells 8, periodic\n initial u = " + s.initial +
         "\n initial v = 0.2\n c = " + s.coefficient + "\n f = " + s.control +
         " every 1/8\n wall = x < 1\n at t = 0.5: u = " + s.event + "\n " + s.items +
         "\n time 0 .. 1, step 1/16\n}\ntask t : s { " + s.unknowns + " minimise mean(" + s.loss + ") + mean(v^2) }\n";
}

TEST(Switches, TheTemplateIsSmooth) { EXPECT_EQ(code_refused(text_of({})), ""); }

struct Case {
  const char* name;
  Slots slots;
  const char* code;  // "": allowed
};

void expect_codes(const std::vector<Case>& cases) {
  for (const Case& one : cases) EXPECT_EQ(code_refused(text_of(one.slots)), one.code) << one.name;
}

/// Limiters, fluxes and phase changes as users write them: continuous branches, some where a root or a parameter's sign
/// limits the domain.
TEST(Switches, FormulasOfTheFieldAreTaken) {
  const auto scene = [](const std::string& declarations, const std::string& rate) {
    return code_refused(declarations + "\nmodel m { field u, v; param k = 0.7; dt(u) = " + rate +
                        "; dt(v) = -v + 0*k }\nscene s : m { grid x = 0 .. 1, cells 8, periodic\n initial u = 0.5 + "
                        "0.4*sin(2*pi*x); initial v = 1; time 0 .. 0.1, step 0.01 }\n"
                        "task t : s { unknown k; unknown initial u; minimise mean(u^2) }\n");
  };
  EXPECT_EQ(
      scene("operator r(u, k) order 1 = -k*if((u[+1] - u)*(u - u[-1]) <= 0, 0, if(abs(u[+1] - u) < abs(u - u[-1]), "
            "u[+1] - u, u - u[-1]))/hx",
            "r(u, k)"),
      "");
  EXPECT_EQ(scene("function g(a, b) = if(a > b, if(a + b > 0, a^2/2, b^2/2), if(a > 0, a^2/2, if(b < 0, b^2/2, 0)))\n"
                  "operator r(u, k) order 1 = -k*(g(u, u[+1]) - g(u[-1], u))/hx",
                  "r(u, k)"),
            "");
  EXPECT_EQ(scene("function hll(sl, sr, fl, fr, a, b) = if(sl >= 0, fl, if(sr <= 0, fr, (sr*fl - sl*fr + sl*sr*(b - "
                  "a))/(sr - sl)))\nfunction f(a, p, b, q) = hll(min(a - sqrt(p), b - sqrt(q)), max(a + sqrt(p), b + "
                  "sqrt(q)), a^2, b^2, a, b)\n"
                  "operator r(u, v) order 1 = (f(u, v, u[+1], v[+1]) - f(u[-1], v[-1], u, v))/hx",
                  "-0.01*r(u, v) - k*u"),
            "");
  EXPECT_EQ(scene("function T(H, L) = if(H < 0, H/2, if(H > L, (H - L)/2, 0))", "0.01*lap(T(u - 0.5, 0.2*k))"), "");
  EXPECT_EQ(scene("", "-k*if(u > 0.6, exp(-1/u), 0)"), "E0609");
}

/// The window between two comparisons is narrow compared with the surrounding ranges.
TEST(Switches, NarrowWindowsAreLookedInto) {
  const auto scene = [](const std::string& condition) {
    return code_refused("model m { field T; param k = 0.4; dt(T) = k*(290 - T) + if(" + condition +
                        ", 30, 0) }\nscene s : m { initial T = 272; time 0 .. 1, step 1/370 }\n"
                        "task t : s { unknown k; minimise (T/273)^2 at t = 1 }\n");
  };
  for (const char* condition : {"T > 273.15 and T < 273.2", "T > 273.15 and T < 274.15",
                                "not (T <= 273.15 or T >= 273.16)", "T/1000 > 0.27315 and T^2 < 273.16^2"})
    EXPECT_EQ(scene(condition), "E0609") << condition;
}

/// v depends smoothly on a and b, so only the switch in u can jump.
TEST(Switches, InEachSlotWhatJumpsIsRefused) {
  expect_codes({
      {"rate", {.rate = "-if(u > a, 1, 0.2)"}, "E0609"},
      {"rate by a state", {.rate = "-a*if(u > 0.5, 1, 0.2)"}, "E0609"},
      {"sign", {.rate = "-a*sign(u - 0.5)"}, "E0609"},
      {"fraction", {.rate = "-a*fraction(u)"}, "E0609"},
      {"floor", {.rate = "-a*floor(u)"}, "E0601"},
      {"fraction by floor", {.rate = "-a*(u - floor(u))"}, "E0601"},
      {"floor of a parameter", {.coefficient = "2 + floor(3*a)"}, "E0601"},
      {"floor in a loss", {.loss = "v - floor(3*v)"}, "E0601"},
      {"inside an operator by place",
       {.declarations = "operator w(q) order 1 = hx*if(q > 0.5, 1, 0.2)", .rate = "-a*w(u)"},
       "E0609"},
      {"a parameter without bounds at 0", {.rate = "-if(a > 0, 1, 0.2)*u"}, "E0609"},
      {"inside a derivative", {.rate = "-a*dx(if(u > 0.5, 1, 0.2))"}, "E0609"},
      {"inside a neighbour",
       {.declarations = "operator up(q) order 0 = if(q[-1] > 0.5, q, 2*q)", .rate = "-a*up(u)"},
       "E0609"},
      {"inside a mean", {.rate = "-a*u*mean(if(u > 0.5, 1, 0.2))"}, "E0609"},
      {"inside an advection", {.rate = "-advect(if(u > 0.5, 1, 0.2), u) + a"}, "E0609"},
      {"inside a network's argument", {.rate = "a*n(if(u > 0.5, 1, 0.2))"}, "E0609"},
      {"inside a solve", {.rate = "-a*u + w", .held = " solve lap(w) - w = if(u > 0.5, 1, 0.2) for w"}, "E0609"},
      {"user function", {.declarations = "function h(q) = if(q > 0.5, 1, 0.2)", .rate = "-a*h(u)"}, "E0609"},
      {"nested", {.rate = "-a*if(u > 0, if(v > 0.5, 1, 0.2), u)"}, "E0609"},
      {"and, not", {.rate = "-a*if(not (u > 0.5 and v < 1), 1, 0.2)"}, "E0609"},
      {"initial", {.initial = "if(x < 8*a, 1, 0)"}, "E0609"},
      {"coefficient", {.coefficient = "if(x < 8*a, 1, 2)"}, "E0609"},
      {"event", {.event = "if(u > 0.5, 0.5*u, u + a)"}, "E0609"},
      {"held", {.held = " u = if(v > a, 1, 0) inside wall"}, "E0609"},
      {"loss", {.loss = "if(u > a, 1, 0)"}, "E0609"},
      {"time", {.rate = "if(t < a, 1, 0)"}, "E0609"},
      {"an initial state that moves it", {.rate = "-if(v > 0.3, 1, 0.2)", .unknowns = "unknown initial v;"}, "E0609"},
      {"a coefficient that moves it", {.rate = "-if(c > 2, 1, 0.2) + c", .unknowns = "unknown c;"}, "E0609"},
      {"a control that moves it", {.rate = "-if(f > 0.1, 1, 0.2) + f", .unknowns = "unknown f;"}, "E0609"},
      {"a network that moves it", {.rate = "-if(n(u) > 0.1, 1, 0.2) + n(u)", .unknowns = "learn n;"}, "E0609"},
  });
}

TEST(Switches, WhatOnlyMovesASwitchIsRefused) {
  const std::string rate = "-u + if(t < q, 1, 0)";
  const auto with = [](const Slots& slots) {
    std::string text = text_of(slots);
    text.replace(text.find("b = 0.7"), 7, "b = 0.7, q = 0.437");
    return code_refused(text);
  };
  EXPECT_EQ(with({.rate = rate, .unknowns = "unknown q;"}), "E0607");
  EXPECT_EQ(with({.rate = rate, .unknowns = "unknown q; unknown a;"}), "E0607");
  EXPECT_EQ(with({.rate = "-u + sign(q - t)", .unknowns = "unknown q;"}), "E0607");
  EXPECT_EQ(with({.rate = "-u + if(abs(x - 10*q) < 1, 1, 0)", .unknowns = "unknown q;"}), "E0607");
  EXPECT_EQ(with({.initial = "if(x < 10*q, 1, 0)", .unknowns = "unknown q;"}), "E0607");
  EXPECT_EQ(with({.coefficient = "if(x < 10*q, 1, 0)", .unknowns = "unknown q;"}), "E0607");
  EXPECT_EQ(with({.event = "if(u > q, 0.5, u)", .unknowns = "unknown q;"}), "E0607");
  EXPECT_EQ(with({.loss = "if(u > q, 1, 0)", .unknowns = "unknown q;"}), "E0607");
  EXPECT_EQ(with({.rate = "-u + if(f > 0.1, 1, 0)", .unknowns = "unknown f;"}), "E0607");
  EXPECT_EQ(with({.rate = "-u + if(c > 2.5, 1, 0)", .unknowns = "unknown c;"}), "E0607");
  EXPECT_EQ(with({.rate = "-u + if(n(u) > 0.1, 1, 0)", .unknowns = "learn n;"}), "E0607");
  EXPECT_EQ(with({.rate = "-q*u", .unknowns = "unknown q;"}), "");
}

/// At u = 0 they have a separate value: half the jump lies on each side, whatever the other numbers.
TEST(Switches, WithAValueAtOnePlaceAreRefused) {
  const auto refused_by = [](const std::string& formula, double k) {
    return code_refused("model m { field u, v, w; param k = " + std::to_string(k) +
                        "; dt(u) = u - 1.5*k; dt(v) = -k*v; dt(w) = " + formula +
                        " - 0.3*k*w }\nscene s : m { grid x = 0 .. 1, cells 6, periodic\n"
                        "initial u = sin(2*pi*x); initial v = 1; initial w = 1; time 0 .. 0.1, step 0.01 }\n"
                        "task t : s { unknown k; minimise mean(w^2) }\n");
  };
  for (const char* formula :
       {"sign(u)", "k*sign(u)", "k*sign(k*u)", "sign(u*v)", "k*sign(-u)", "sign(u/k)", "k*0.5*(1 + sign(u))",
        "exp(sign(u))", "sqrt(4 + k*sign(2*u))", "1/(2 + sign(u))", "k*if(u > 0, 1, if(u < 0, -1, 0))",
        "if(u == 0, 0, if(u < 0, k, 1))", "k*if(u >= 0, 1, 0) - if(u <= 0, 1, 0)", "k*u/abs(u)"}) {
    for (const double k : {0.1, 0.3, 0.7, 1.0, 1.1, 1.5, 1.7, 2.0, 3.0})
      EXPECT_EQ(refused_by(formula, k), "E0609") << formula << " with k = " << k;
  }
}

TEST(Switches, KinksAndSwitchesThatNothingMovesAreTaken) {
  expect_codes({
      {"upwind by if", {.rate = "-if(u > 0, u*(u - v), u*(v - 2*u)) + a"}, ""},
      {"the factor vanishes", {.rate = "-u*if(u > 0, u - v, v - 2*u) + a"}, ""},
      {"limiter",
       {.declarations = "function slope(p, q) = if(p*q > 0, 2*p*q/(p + q), 0)", .rate = "-slope(u, v) + a"},
       ""},
      {"clamp", {.rate = "-if(u > a, a, u)"}, ""},
      {"root", {.rate = "-if(u > 0, sqrt(u), 0) + a"}, ""},
      {"guard", {.rate = "-if(abs(u) > 1e-9, sin(u)/u, 1) + a"}, ""},
      {"equality", {.rate = "-if(u == 0, 1, u) + a"}, ""},
      {"sign of a square", {.rate = "-sign(u)*u^2 + a"}, ""},
      {"minmod", {.rate = "-0.5*(sign(u) + sign(v))*min(abs(u), abs(v)) + a"}, ""},
      {"coordinates", {.rate = "-a*if(x < 3 or x > 6, 1, 0.2)*u"}, ""},
      {"time", {.rate = "-a*if(t < 0.3, 1, 0.2)*u"}, ""},
      {"a parameter that is known", {.rate = "-a*if(x < 8*b, 1, 0.2)*u"}, ""},
      {"max, min, abs", {.rate = "-max(u, a) + min(v, u) + abs(u)"}, ""},
      {"a parameter with bounds", {.rate = "-(1 + a)*if(a > 0, 1, 0.2)*u", .unknowns = "unknown a in 0.1 .. 1;"}, ""},
      {"floor of a coordinate", {.rate = "-a*floor(x/2)*u"}, ""},
      {"a wave by floor", {.rate = "-a*(u - floor(u))*(1 - u + floor(u))"}, ""},
      {"a length that is positive", {.rate = "-if(u < 0, u/2, if(u > 0.2*a, (u - 0.2*a)/2, 0)) + a"}, ""},
      {"two switches that meet", {.rate = "-a*(if(u > 0.5, 1, 0) + if(u > 0.5, 0, 1))"}, ""},
      {"both branches of a clamp of time", {.rate = "if(t < a, a - t, 0)"}, ""},
      {"nobody asks", {.rate = "-a*u", .items = "observe e = mean(if(u > 0.5, 1, 0))"}, ""},
  });
}

/// Hat functions between cells, written as conditions of the unknown position.
TEST(Switches, PlacesOfSourcesAndSamplesAreKinks) {
  for (const char* const axis : {"", ", periodic", ", stretched x + 0.1*sin(2*pi*x)"}) {
    const std::string walls = axis == std::string(", periodic") ? "" : "boundary u: x = 0\n";
    EXPECT_EQ(code_refused("model m { field u; param p = 0.4; dt(u) = lap(u) + inject(1, at = p) }\n"
                           "scene s : m { grid x = 0 .. 1, cells 8" +
                           std::string(axis) + "\n" + walls +
                           "initial u = 0; time 0 .. 0.01, step 0.001 }\n"
                           "task t : s { unknown p; minimise (sample(u, at = p) - 1)^2 }\n"),
              "")
        << axis;
  }
}

TEST(Switches, AJumpIsTakenByForce) {
  const std::string jump = text_of({.rate = "-a*if(u > 0.5, 1, 0.2)"});
  EXPECT_EQ(code_refused(jump), "E0609");
  EXPECT_EQ(code_refused(jump, true), "");
}

/// Equivalent forms of a formula are both allowed, or both refused.
TEST(Switches, FormsOfOneFormulaAreJudgedAlike) {
  for (const bool is_forced : {false, true}) {
    const auto is_taken = [&](const std::string& rate) {
      return code_refused(text_of({.rate = "-a*(" + rate + ")"}), is_forced).empty();
    };
    EXPECT_EQ(is_taken("fraction(0.1*u + 3.3)"), is_forced);
    EXPECT_EQ(is_taken("0.1*u + 3.3 - floor(0.1*u + 3.3)"), is_forced);
    EXPECT_EQ(is_taken("sign(u - 0.5)"), is_forced);
    EXPECT_EQ(is_taken("if(u > 0.5, 1, if(u < 0.5, -1, 0))"), is_forced);
  }
}

TEST(Switches, AnUnknownThatOnlySetsTheStepsIsRefused) {
  EXPECT_EQ(code_refused(R"(model m { field u; param q = 2; dt(u) = -0.5*dx(u) }
scene s : m { grid x = 0 .. 8, cells 8, periodic; initial u = sin(x); time 0 .. 1, step 1/4, courant 0.5, speed q }
task t : s { unknown q; minimise mean(u^2) }
)"),
            "E0607");
}

/// With --force, certificates report them.
TEST(Switches, HandWrittenStepsThatJumpAreKnown) {
  const auto jumps = [](const std::string& rate) {
    const SourceFile source("step.dpde", "kernel grow(u: field, out v: field, dt, k: param) { v = u + dt*(" + rate +
                                             ") }\nprogram p { axes x periodic; run grow; swap u, v }\n" +
                                             "scene s : p {\n grid x = 0 .. 1, cells 8, periodic\n k = 0.5\n " +
                                             "initial u = x\n time 0 .. 1, step 1/8\n}\n" +
                                             "task t : s { unknown k; minimise mean(u^2) at t = 1 }\n");
    driver::CompileOptions options;
    options.selection.name = "t";
    options.adjoint = options.takes_jumps = true;
    const auto scene = compiled(source, options);
    return scene ? scene->jumps_left_out.size() : 9;
  };
  EXPECT_EQ(jumps("if(u > k, k, 0.2)"), 1u);
  EXPECT_EQ(jumps("k*max(u - k, 0)"), 0u);
  EXPECT_EQ(jumps("k*floor(u)"), 1u);
  EXPECT_EQ(jumps("k*(u - floor(u))*(1 - u + floor(u))"), 0u);
  EXPECT_EQ(jumps("if(u < 0, u/2, if(u > 0.2*k, (u - 0.2*k)/2, 0))"), 0u);
}

}  // namespace
}  // namespace dpde::testing
