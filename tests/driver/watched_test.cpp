// SPDX-License-Identifier: Apache-2.0
// Conditions that gradients watch during a run: formulas that are differentiable as long as a divisor keeps its sign,
// or a condition does not switch. In each kind of formula of a problem; the reference is differences of the loss.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/setting.h"
#include "watched_support.h"

namespace dpde::testing {
namespace {

/// p starts at 1 and falls by k.
std::string falling(const std::string& slot, const std::string& formula, double k) {
  const auto in = [&](const std::string& name, const std::string& else_text) {
    return slot == name ? formula : else_text;
  };
  return "operator turned(z) order 0 = atan(1/z)\n"
         "model m { field u, v, p, r; param k = " +
         std::to_string(k) + "; mask wall\n u = " + in("held", "0.1") + " inside wall\n dt(u) = -u + 0.3*v + " +
         in("rate", "0.1") +
         "\n dt(v) = lap(v) - v + 0.3*u\n dt(p) = -k\n dt(r) = -0.1*r\n}\n"
         "scene s : m { grid x = 0 .. 4, cells 4\n boundary u: x = 0\n boundary v: x = " +
         in("boundary", "0.1") + "\n boundary p: x = zero_gradient\n boundary r: x = zero_gradient\n" +
         " initial u = 0.2; initial v = 0.2; initial p = 1; initial r = 1\n wall = x < 1\n after step: u = u + " +
         in("event", "0") + "\n time 0 .. 1, step 1/200\n}\n" +
         "task t : s { unknown k; minimise mean(u^2) + mean(v^2); minimise 0.1*mean(" + in("loss", "u") +
         ") over time }\n";
}

constexpr const char* slots_in_time[] = {"rate", "held", "boundary", "event", "loss"};

/// All of these in the slot "rate", one of them in each slot.
constexpr const char* spellings[] = {"atan(1/p)",         "tanh(1/p^3)",  "1/(1 + exp(1/p))", "atan(p/p^2)",
                                     "atan(0.1*r/(p*r))", "turned(p)",    "turned(2*p)",      "atan(1/(p + 0*u))",
                                     "atan(1/(p*p*p))",   "atan(p^(-1))", "mean(atan(1/p))",  "atan(1/(r*p - 0*r))"};

TEST(LostSigns, AreRefusedInEachSlot) {
  for (std::size_t i = 0; i < std::size(slots_in_time); ++i) {
    const std::string slot = slots_in_time[i];
    const std::string formula = slot == "event" ? "0.02*atan(1/p)" : "atan(1/p)";
    const FoundGradient lost = gradient_of(falling(slot, formula, 1.3));
    EXPECT_TRUE(lost.is_refused) << slot;
    EXPECT_TRUE(lost.is_wrong()) << slot << ": " << lost.gradient << " and " << lost.secant;
    if (!is_tried(i, 2)) continue;
    const FoundGradient kept = gradient_of(falling(slot, formula, 0.7));
    EXPECT_FALSE(kept.is_refused) << slot;
    EXPECT_FALSE(kept.is_wrong()) << slot << ": " << kept.gradient << " and " << kept.secant;
  }
}

TEST(LostSigns, AreRefusedInEachSpelling) {
  for (std::size_t i = 0; i < std::size(spellings); ++i) {
    if (!is_tried(i, 4)) continue;
    const FoundGradient lost = gradient_of(falling("rate", spellings[i], 1.3));
    EXPECT_TRUE(lost.is_refused) << spellings[i];
    EXPECT_TRUE(lost.is_wrong()) << spellings[i] << ": " << lost.gradient << " and " << lost.secant;
  }
}

/// p changes sign and the divisor does not; or both limits agree.
TEST(LostSigns, OfWhatKeepsItsSignAreTaken) {
  constexpr const char* formulas[] = {"atan(1/(1 + p))",     "atan(1/(p^2 + 0.1))", "p*atan(1/p)",
                                      "atan(1/(r + 0.5*p))", "tanh(1/r)",           "sin(p)/p"};
  for (std::size_t i = 0; i < std::size(formulas); ++i) {
    if (!is_tried(i, 2)) continue;
    const FoundGradient found = gradient_of(falling("rate", formulas[i], 1.3));
    EXPECT_FALSE(found.is_refused) << formulas[i];
    EXPECT_FALSE(found.is_wrong()) << formulas[i] << ": " << found.gradient << " and " << found.secant;
  }
}

/// A zero without a change of sign cannot be observed in a run; the certificate says so.
TEST(LostSigns, OfWhatKeepsItsSignAtZeroAreTold) {
  const auto is_told = [](const std::string& formula) {
    const SourceFile source("signs.dpde", falling("rate", formula, 0.7));
    driver::CompileOptions options;
    options.selection.name = "t";
    options.adjoint = true;
    const auto scene = compiled(source, options);
    return scene && !scene->unwatched.empty();
  };
  for (const char* formula : {"atan(p/(1 - cos(p)))", "tanh(p/(exp(p^2) - 1))", "atan(1/(p*(1 - cos(r - p))))"})
    EXPECT_TRUE(is_told(formula)) << formula;
  for (const char* formula : {"atan(1/p)", "atan(p/p^2)", "atan(1/(p*(1e-3 + p^2)))", "atan(1/(p*(1 + p^2)))",
                              "p^2/(1 - cos(p))", "atan(r/(cosh(p) - 1))", "atan(1/(exp(p) - 1))"})
    EXPECT_FALSE(is_told(formula)) << formula;
}

struct RunCase {
  std::string model, scene, loss;
  bool is_refused;
};

/// Runs with intermediate states, runs to rest, runs that begin on both sides, or conditions that matter only at a few
/// times: the formula is atan(1/z), or jumps at z = 0.
std::vector<RunCase> run_cases() {
  const auto swinging = [](const std::string& k, const std::string& time, bool is_refused) {
    return RunCase{
        "field p, r, q; param k = " + k + "; dt(p) = r; dt(r) = -4*(p - k) - 0.4*r; dt(q) = atan(1/p)",
        "grid x = 0 .. 1, cells 4, periodic; initial p = 2; initial r = 0; initial q = 0; time 0 .. 3.2, " + time,
        "minimise mean((q + 1)^2)", is_refused};
  };
  const auto resting = [](const std::string& k, const std::string& rate, bool is_refused) {
    return RunCase{"field u, q; param k = " + k + "; dt(u) = k - x - u; dt(q) = " + rate + " - q",
                   "grid x = 0 .. 1, cells 100; boundary u: all = zero_gradient; boundary q: all = zero_gradient; "
                   "initial u = 1; initial q = 0; time 0 .. 60, step 1/10, until steady 1e-10",
                   "minimise mean(" + std::string(rate == "0" ? "atan(1/u)" : "q") + ")", is_refused};
  };
  const auto of_noise = [](const std::string& start, bool is_refused) {
    return RunCase{
        "field u; param k = 0.3; coefficient c; dt(u) = -u",
        "grid x = 0 .. 1, cells 512, periodic; c = noise(3); initial u = " + start + "; time 0 .. 0.02, step 1/100",
        "minimise mean(atan(1/u))", is_refused};
  };
  const auto falling_to = [](const std::string& loss, const std::string& start, bool is_refused) {
    return RunCase{"field u; param k = 1; dt(u) = -k",
                   "grid x = 0 .. 1, cells 100, periodic; initial u = " + start + "; time 0 .. 1, step 1/100", loss,
                   is_refused};
  };
  return {swinging("0.8", "step 3.2, tolerance 1e-6", true),
          swinging("1.5", "step 3.2, tolerance 1e-6", false),
          swinging("0.8", "step 1.6, tolerance 1e-4", true),
          swinging("0.8", "step 3.2, courant 0.1, speed 1", true),
          swinging("1.5", "step 3.2, courant 0.1, speed 1", false),
          resting("0.5", "0", true),
          resting("1.5", "0", false),
          resting("-0.5", "0", false),
          resting("0.5", "atan(1/u)", true),
          resting("1.5", "atan(1/u)", false),
          of_noise("c - k", true),
          of_noise("c*k", false),
          of_noise("(c - k)*k", true),
          falling_to("minimise mean(atan(1/u)) at t = 1", "0.5", false),
          falling_to("minimise mean(atan(1/u)) at t = 1", "0.5 + 0.3*sin(2*pi*x)", false),
          falling_to("minimise mean(atan(1/u)) at t = 1", "1 + 0.3*sin(2*pi*x)", true),
          falling_to("minimise mean(atan(1/u)) at t = 0.2, 1", "0.5", false),
          falling_to("minimise mean(atan(1/u)) at t = 1; minimise mean(u^2) over time", "0.5", false),
          falling_to("minimise mean(atan(1/u)) at t = 1; minimise mean(atan(2/u)) over time", "0.5", true),
          falling_to("minimise mean((1 + u)*if(u > 0, 1, 0.2)) at t = 1", "0.5", false),
          falling_to("minimise mean((1 + u)*if(u > 0, 1, 0.2)) at t = 1", "1 + 0.3*sin(2*pi*x)", true),
          falling_to("minimise mean((1 + u)*if(u > 0, 1, 0.2)) over time", "0.5", true)};
}

TEST(WatchedRuns, AreRefusedWhereALossHangsOnAJump) {
  const std::vector<RunCase> cases = run_cases();
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const RunCase& c = cases[i];
    const std::string scheme = c.scene.find("tolerance") == std::string::npos ? "" : " with e";
    const FoundGradient found =
        gradient_of("model m { " + c.model + " }\nscheme e { time = dopri5 }\nscene s : m" + scheme + " { " + c.scene +
                    " }\ntask t : s { unknown k; " + c.loss + " }\n");
    const std::string what = c.scene + "; " + c.loss;
    EXPECT_EQ(found.is_refused, c.is_refused) << what;
    EXPECT_EQ(found.is_wrong(), c.is_refused) << what << ": " << found.gradient << " and " << found.secant;
  }
}

/// p goes from 1 to -0.3.
TEST(WatchedSwitches, AreRefusedWhereTheyAct) {
  constexpr const char* acting[] = {"if(p > 0.5, 1, 0.2)", "if(p < 0.2 and p > 0.1, 0, 1)", "sign(p + 0.1)",
                                    "3*sign(0.2 - p)*u", "if(p > 9, 2, if(p > 0.4, 1, 0))"};
  constexpr const char* idle[] = {"if(p > 5, 1, p)", "if(p < -1 or p > 3, 4, p*u)", "sign(p - 7)*p", "sign(p + 7)*p",
                                  "if(p > 9, 2, if(p < -4, 1, p))"};
  for (std::size_t i = 0; i < std::size(acting); ++i) {
    if (!is_tried(i, 2)) continue;
    const FoundGradient found = gradient_of(falling("rate", "(1 + 0.1*p)*" + std::string(acting[i]), 1.3));
    EXPECT_TRUE(found.is_refused) << acting[i];
    EXPECT_TRUE(found.is_wrong()) << acting[i] << ": " << found.gradient << " and " << found.secant;
  }
  for (std::size_t i = 0; i < std::size(idle); ++i) {
    if (!is_tried(i, 2)) continue;
    const FoundGradient found = gradient_of(falling("rate", idle[i], 1.3));
    EXPECT_FALSE(found.is_refused) << idle[i];
    EXPECT_FALSE(found.is_wrong()) << idle[i] << ": " << found.gradient << " and " << found.secant;
  }
}

/// At p = 0 they have a separate value, and half the jump lies on each side.
TEST(WatchedSwitches, WithAValueAtOnePlaceAreRefused) {
  constexpr const char* formulas[] = {"sign(p)", "sign(k*p*r)", "exp(sign(-p))", "1/(2 + sign(p/k))",
                                      "if(p > 0, 1, if(p < 0, -1, 0))"};
  for (std::size_t i = 0; i < std::size(formulas); ++i) {
    if (!is_tried(i, 2)) continue;
    const FoundGradient found = gradient_of(falling("rate", "k*" + std::string(formulas[i]), 1.3));
    EXPECT_TRUE(found.is_refused) << formulas[i];
    EXPECT_TRUE(found.is_wrong()) << formulas[i] << ": " << found.gradient << " and " << found.secant;
  }
}

TEST(WatchedSwitches, ActInEachSlot) {
  for (std::size_t i = 0; i < std::size(slots_in_time); ++i) {
    if (!is_tried(i, 2)) continue;
    const std::string slot = slots_in_time[i], of_event = slot == "event" ? "0.02*" : "";
    const FoundGradient acting = gradient_of(falling(slot, of_event + "(1 + 0.1*p)*if(p > 0.5, 1, 0.2)", 1.3));
    EXPECT_TRUE(acting.is_refused) << slot;
    EXPECT_TRUE(acting.is_wrong()) << slot << ": " << acting.gradient << " and " << acting.secant;
    const FoundGradient idle = gradient_of(falling(slot, of_event + "if(p > 5, 1, 0.2*p)", 1.3));
    EXPECT_FALSE(idle.is_refused) << slot;
    EXPECT_FALSE(idle.is_wrong()) << slot << ": " << idle.gradient << " and " << idle.secant;
  }
}

}  // namespace
}  // namespace dpde::testing
