// SPDX-License-Identifier: Apache-2.0
// Formulas that jump at a division by 0, in each formula of a problem, compared with differences of the loss; and usual
// formulas that divide without jumping.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "driver/compile/switches.h"
#include "driver/scene/inverse.h"
#include "driver_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Each jumps at z = 0.
constexpr const char* jumping_formulas[] = {"z/abs(z)",      "z/sqrt(z^2)",  "abs(z)/z",        "max(z, 0)/z",
                                            "(z^2)^0.5/z",   "atan(1/z)",    "tanh(1/z)",       "min(z, 0)/abs(z)",
                                            "z*abs(z)^(-1)", "z^3/abs(z)^3", "1/(1 + exp(1/z))"};

struct PoleSlot {
  const char* name;
  const char* z;  // passes 0 as the unknown changes
  bool is_by_states = false;
};
constexpr PoleSlot pole_slots[] = {{"rate", "(t - a)"},          {"held", "(t - a)"},      {"initial", "(x/8 - a)"},
                                   {"coefficient", "(x/8 - a)"}, {"boundary", "(t - a)"},  {"loss", "(u - a)", true},
                                   {"event", "(u - a)", true},   {"rate", "(u - a)", true}};

std::string with_z(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

/// `formula` in the slot; all other formulas are smooth.
std::string text_with_pole(const std::string& slot, const std::string& formula, const std::string& unknown = "a") {
  const auto in = [&](const std::string& name, const std::string& else_text) {
    return slot == name ? formula : else_text;
  };
  return "network n(q) { initial he, seed 1; conv 4, 3; tanh; conv 1, 3 }\n"
         "model m { field u, v, w; param a = 0.4; param b = 5; coefficient c; mask wall\n u = " +
         in("held", "0.1") + " inside wall\n dt(u) = -u + 0.1*c + 0.01*v + " + in("rate", "0.1") +
         "\n dt(v) = lap(v) - v + 0.3*u + 0.01*a + 0.01*b\n dt(w) = -w\n}\nscene s : m { grid x = 0 .. 8, cells 8\n" +
         " boundary u: x = 0\n boundary v: x = " + in("boundary", "0.1*a") + "\n boundary w: x = 1\n" +
         " initial u = sin(x) + 0.1*" + in("initial", "a") + "\n initial v = 0.2\n initial w = 1 + x\n c = 2 + " +
         in("coefficient", "a") + "\n wall = x < 1\n at t = 0.5: u = " + in("event", "u") +
         "\n time 0 .. 1, step 1/16\n}\ntask t : s { unknown " + unknown + "; minimise mean(u^2 + " + in("loss", "0") +
         ") + mean(v^2) }\n";
}

/// The jump of the loss at a = 7/16, where z is 0 in a cell or at a step, without the effect of its slope.
double jump_by_differences(const std::string& text, double apart = 1e-9) {
  const SourceFile source("poles.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.adjoint = options.takes_jumps = true;
  options.backend = driver::Backend::interpreter;
  DiagnosticSink sink;
  auto compiled = driver::compile(source, options, sink);
  EXPECT_TRUE(compiled) << all_messages(source, sink);
  if (!compiled) return NAN;
  const auto session =
      driver::Session::open(source, std::make_shared<const driver::Compiled>(std::move(*compiled)), {}, sink);
  const auto inverse = session ? driver::Inverse::open(*session, source, sink) : nullptr;
  EXPECT_TRUE(inverse) << all_messages(source, sink);
  if (!inverse) return NAN;
  const auto loss = [&](double a) { return inverse->value(Eigen::VectorXd::Constant(1, a)); };
  const auto difference = [&](double distance) { return loss(0.4375 + distance) - loss(0.4375 - distance); };
  return std::abs(2 * difference(apart) - difference(2 * apart));
}

TEST(JumpsAtPoles, TheTemplateIsSmooth) {
  EXPECT_EQ(code_refused(text_with_pole("", "")), "");
  EXPECT_LT(jump_by_differences(text_with_pole("", "")), 1e-8);
}

TEST(JumpsAtPoles, AreRefusedInEachSlot) {
  for (const PoleSlot& slot : pole_slots) {
    for (const char* formula : jumping_formulas) {
      EXPECT_EQ(code_refused(text_with_pole(slot.name, with_z(formula, "z", slot.z))), "E0609")
          << slot.name << ": " << formula;
    }
  }
}

TEST(JumpsAtPoles, AreThoseOfDifferences) {
  for (const PoleSlot& slot : pole_slots) {
    if (slot.is_by_states) continue;
    for (const char* formula : jumping_formulas) {
      EXPECT_GT(jump_by_differences(text_with_pole(slot.name, with_z(formula, "z", slot.z))), 1e-5)
          << slot.name << ": " << formula;
    }
    for (const char* formula : {"z/(abs(z) + 1e-2)", "z*abs(z)/sqrt(z^2)", "z*atan(1/z)", "sin(z)/z", "tanh(1/z^2)"}) {
      const std::string text = text_with_pole(slot.name, with_z(formula, "z", slot.z));
      EXPECT_EQ(code_refused(text), "") << slot.name << ": " << formula;
      EXPECT_LT(jump_by_differences(text), 1e-6) << slot.name << ": " << formula;
    }
  }
}

TEST(JumpsAtPoles, InsideOperatorsAndBesideOthers) {
  for (const char* formula : {"mean((u - a)/abs(u - a))",
                              "dx((u - a)/abs(u - a))",
                              "n((u - a)/abs(u - a))",
                              "a*u/abs(u)",
                              "a*v*u/sqrt(u^2)",
                              "a*(u - v)/abs(u - v)",
                              "a*dx(u)/abs(dx(u))",
                              "a*atan(tan(u))",
                              "2*a + 0.5*(1 + u/abs(u))",
                              "a*atan(v/u)",
                              "a*u*exp(-log(abs(u)))",
                              "a*(abs(u) - u)/u",
                              "a*v/abs(v)",
                              "1/(t - a)",
                              "a*tanh(1/u)",
                              "a*u/max(u, -u)",
                              "a*u/if(u > 0, u, -u)",
                              "a*u*abs(1/u)",
                              "a*u/(u^4)^0.25",
                              "a*max(u, 0)/max(abs(u), 1e-300)",
                              "a*log(exp(u/abs(u)))",
                              "a*(u - 0.1)/((u - 0.1)^2)^(1/2)",
                              "(x - 10*a)/abs(x - 10*a)"})
    EXPECT_EQ(code_refused(text_with_pole("rate", formula)), "E0609") << formula;
}

/// The limits on both sides agree, or the divisor keeps its sign: w is initially positive, u has both signs.
TEST(JumpsAtPoles, FormulasOfTheFieldAreTaken) {
  for (const char* formula : {"a*u/(abs(u) + 1e-6)",
                              "a*u/(abs(u) + 1e-12)",
                              "a*u/(abs(u) + 1e-30)",
                              "a*u/sqrt(u^2 + v^2)",
                              "a*u/sqrt(u^2 + 1e-12)",
                              "u/abs(u)*u*a",
                              "a/u",
                              "a*v/u",
                              "a*u*abs(u)/abs(u)",
                              "a*tanh(1/w)",
                              "a/(exp(1/w) - 1)",
                              "u*tanh(1/a)",
                              "tanh((x - 4)/a)",
                              "1/(t - b)",
                              "b/(1 + b*t)",
                              "a*sin(u)/u",
                              "(exp(u) - 1)/u*a",
                              "a*(1 - cos(u))/u^2",
                              "u/(a + u)",
                              "a*exp(-1/u)",
                              "a*tanh(1/u^2)",
                              "a*(u/v + abs(u/v))/(1 + abs(u/v))*v",
                              "a*max(0, min(1, u/v))*v",
                              "a*(u^2 - v^2)/(u - v)",
                              "a*(exp(u) - exp(v))/(u - v)",
                              "a*u*tanh(1/u)",
                              "a*u^3/abs(u)",
                              "a*if(abs(u) > 1e-9, sin(u)/u, 1)",
                              "a*u/(abs(u) + abs(v) + 1e-12)",
                              "a*log(abs(u) + 1)",
                              "a*u*log(u^2 + 1e-300)",
                              "a*u^2/sqrt(u^2)",
                              "a/abs(u)",
                              "a*atan(1/abs(u))",
                              "a*u/sqrt(abs(u))",
                              "a*u/max(abs(u), 1e-10)",
                              "a*tan(u)",
                              "a*atan(v/w)",
                              "min(1, x/a)",
                              "a*(1 - exp(-u/w))",
                              "min(1, max(0, 1e9*(t - a)))",
                              "1/(1 + exp(-1e9*(t - a)))",
                              "a*u*v/(u + v)",
                              "(u - u^3/abs(u)^2)*a",
                              "a*w^1.5/(1 + w)",
                              "a*w^(-0.5)",
                              "a*max(w, 0)^0.3",
                              "a*(u*abs(v) + abs(u)*v)/(abs(u) + abs(v) + 1e-15)",
                              "a*max(0, min(1, (u - 0.1)/(v - u + 1e-12)))*(v - u)",
                              "a*w*log(w)",
                              "sin(x - 10*a)/(x - 10*a + 1e-14)",
                              "a*dx(u)/sqrt(dx(u)^2 + 1e-8)",
                              "a*u/(u^2 + v^2)^0.5",
                              "a*min(1, 0.1/(abs(dx(u)) + 1e-14))*u",
                              "a*if(u > 0, u/(u + w), 0)",
                              "a/(exp(a/w) - 1)",
                              "a*u*w/(u + w)",
                              "(u - a)*abs(u - a)/sqrt((u - a)^2 + 1e-10)",
                              "a*sqrt(abs(u))*u/abs(u)",
                              "(x - 4)/sqrt((x - 4)^2 + a^2)"})
    EXPECT_EQ(code_refused(text_with_pole("rate", formula)), "") << formula;
}

/// c*z - d in floating-point numbers is a staircase that may never be exactly 0.
TEST(JumpsAtPoles, OfLinesWithNumbersAreRefused) {
  const auto code_of = [](const std::string& rate, const std::string& initial = "-0.1") {
    return code_refused("model m { field u, q; param a = 0.3; dt(u) = a; dt(q) = " + rate +
                        " }\nscene s : m { initial u = " + initial +
                        "; initial q = 0; time 0 .. 1, step 1/16 }\n"
                        "task t : s { unknown a; minimise q^2 }\n");
  };
  std::vector<std::string> lines{"(330*u - 0.19)", "(1600*u - 0.45)", "(4500*u - 120)", "(3*u - 1e-3)"};
  const auto with_numbers = [&](int first, int second) {
    constexpr const char* sizes[] = {"0", "00", "000", ".5"};
    lines.push_back("(" + std::to_string(first) + sizes[first % 4] + "*u - 0." + std::to_string(second) + ")");
  };
  const int count = is_thorough() ? 300 : 8;
  for (int k = 0; k < count; ++k) with_numbers(1 + 37 * k % 97, 1 + 53 * k % 89);
  for (const std::string& z : lines) {
    for (const char* formula : {"z/abs(z)", "abs(z)/z", "z/sqrt(z^2)", "z*abs(z)^(-1)", "z^3/abs(z)^3", "max(z, -z)/z"})
      EXPECT_EQ(code_of(with_z(formula, "z", z)), "E0609") << z << ": " << formula;
    EXPECT_EQ(code_of(with_z("atan(1/z)", "z", z), "0"), "E0609") << z;
    for (const char* formula : {"z/abs(z)^0.5", "z*abs(z)/sqrt(z^2)", "z/(abs(z) + 1e-3)"})
      EXPECT_EQ(code_of(with_z(formula, "z", z)), "") << z << ": " << formula;
  }
}

/// The sign of values from files and of noise is not known from the text; sin(x) has both.
TEST(JumpsAtPoles, OfFieldsOfUnknownSignAreTaken) {
  const auto text = [](const std::string& initial, const std::string& rate) {
    return "model m { field T, q; coefficient c; param a = 0.3; dt(T) = a*lap(T); dt(q) = a*c*" + rate +
           " }\nscene s : m { grid x = 0 .. 8, cells 8, periodic; initial T = " + initial +
           "; initial q = 0; c = load(\"c.npy\"); time 0 .. 1, step 1/16 }\n"
           "task t : s { unknown a; minimise mean(q^2) }\n";
  };
  for (const char* rate : {"1/(exp(1000/T) - 1)", "tanh(1000/T)", "1/(1 + exp(-1000/T))", "atan(c/T)"}) {
    for (const char* initial : {"load(\"T.npy\")", "300 + 10*sin(x)", "300 + noise(1)"})
      EXPECT_EQ(code_refused(text(initial, rate)), "") << initial << ": " << rate;
  }
  for (const char* rate : {"tanh(1000/T)", "atan(c/T)"}) EXPECT_EQ(code_refused(text("sin(x)", rate)), "E0609") << rate;
  for (const char* rate : {"T/abs(T)", "(T - 300)/sqrt((T - 300)^2)"})
    EXPECT_EQ(code_refused(text("load(\"T.npy\")", rate)), "E0609") << rate;
}

/// Near its zero the divisor is only rounding: values there do not show whether both limits agree.
constexpr const char* jumping_where_it_cancels[] = {"z/sqrt(1 - cos(z)^2)",
                                                    "z/sqrt(cosh(z)^2 - 1)",
                                                    "z/abs(exp(z) - 1)",
                                                    "z/sqrt((exp(z) - 1)^2)",
                                                    "z/sqrt(z*z)",
                                                    "z/sqrt(((1 + z) - 1)^2)",
                                                    "sin(z)/sqrt(2 - 2*cos(z))",
                                                    "(exp(z) - 1)/sqrt(1 - cos(z)^2)",
                                                    "z/(cosh(z) - 1)^0.5",
                                                    "z^3/sqrt(cosh(z)^2 - 1)^3",
                                                    "sqrt(cosh(z)^2 - 1)/z",
                                                    "z/sqrt(1 - exp(-z^2))",
                                                    "z/sqrt(log(1 + z^2))",
                                                    "z/sqrt(sqrt(1 + z^2) - 1)",
                                                    "tanh(z/(cosh(z) - 1))",
                                                    "z/abs(z + 1e3 - 1e3)",
                                                    "z/(cosh(z) - 1 - z^2/2)^0.25",
                                                    "z/abs(tanh(z + 1) - tanh(1))",
                                                    "abs(z)/(log(2 + z) - log(2))"};
constexpr const char* meeting_where_it_cancels[] = {"z^2/sqrt(1 - cos(z)^2)",
                                                    "z^3/sqrt(cosh(z)^2 - 1)",
                                                    "(exp(z) - 1)/z",
                                                    "z/(exp(z) - 1)",
                                                    "(1 - cos(z))/z^2",
                                                    "(1 - cos(z))/sqrt(1 - cos(z)^2)",
                                                    "z/sqrt(1 - cos(z)^2 + 1e-2)",
                                                    "abs(z)/sqrt(1 - cos(z)^2)",
                                                    "z*abs(z)/sqrt(1 - cos(z)^2)",
                                                    "(cosh(z) - 1)/(1 - cos(z))",
                                                    "z*abs(exp(z) - 1)/(exp(z) - 1)",
                                                    "z^4/(cosh(z) - 1 - z^2/2)",
                                                    "(z - sin(z))/z^3",
                                                    "(sqrt(1 + z) - 1)/z",
                                                    "sqrt(1 - cos(z)^2)/sqrt(cosh(z)^2 - 1)",
                                                    "z/((1 + z) - 1)",
                                                    "exp(-1/(1 - cos(z)^2))"};

/// Differences are taken at a distance larger than the range of rounding.
TEST(JumpsAtPoles, WhereDivisorsCancelAreThoseOfDifferences) {
  const auto expect = [](const char* formula, bool jumps) {
    for (const char* z : {"(t - a)", "(2*u - 0.7*v)", "(u - a)"}) {
      const std::string text = text_with_pole("rate", with_z(formula, "z", z));
      EXPECT_EQ(code_refused(text), jumps ? "E0609" : "") << formula << ", z = " << z;
    }
    const double jump = jump_by_differences(text_with_pole("rate", with_z(formula, "z", "(t - a)")), 4e-3);
    EXPECT_EQ(jump > 1e-3, jumps) << formula << ": " << jump;
  };
  for (const char* formula : jumping_where_it_cancels) expect(formula, true);
  for (const char* formula : meeting_where_it_cancels) expect(formula, false);
}

}  // namespace
}  // namespace dpde::testing
