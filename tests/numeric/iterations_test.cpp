// SPDX-License-Identifier: Apache-2.0
// `solve ... after n iterations`: the result of this number of conjugate-gradient iterations equals the solver's, with
// derivatives through the iterations and the guess.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/opened_scene.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// An operator, sides of psi, and the axes that go with them.
struct Equation {
  std::string operation, sides, axes = "periodic; walls";
  bool is_singular = false;
};

std::string axis(const char* name, int cells, const std::string& rest) {
  return "grid " + std::string(name) + " = 0 .. 1, cells " + std::to_string(cells) + rest + "\n";
}

/// One step of length 1 adds psi to w.
std::string scene_of(const Equation& equation, const std::string& behind, const std::string& scheme,
                     const std::string& loss = "mean(psi^2) + mean(w*psi)") {
  const bool is_box = equation.axes == "walls";
  const std::string x = is_box ? "" : ", periodic", y = equation.axes == "rings" ? ", periodic" : "";
  const std::string of_w = is_box ? "all" : "y";
  const bool learns = behind.find("first") != std::string::npos || loss.find("first") != std::string::npos;
  const std::string padding = std::string("padding x ") + (is_box ? "zero" : "periodic") + ", y " +
                              (equation.axes == "rings" ? "periodic" : "zero");
  const std::string layers = "; initial he, seed 1; conv 3, 3; tanh; conv out, 3 }\n";
  return "network first(r) -> g { real f64; " + padding + layers +
         "model m { field w; coefficient k; param e = 0.7; solve " + equation.operation + " = -w for psi" + behind +
         "; dt(w) = psi }\nscheme c { time = euler; " + scheme + " }\nscene s : m with c {\n" + axis("x", 6, x) +
         axis("y", 5, y) + (y.empty() ? "boundary w: " + of_w + " = zero_gradient\n" : "") +
         (y.empty() ? "boundary psi: " + equation.sides + "\n" : "") +
         "k = 1.3 + 0.5*sin(2*pi*x)*cos(3*y)\ninitial w = sin(2*pi*x)*(1 + y) + cos(5*y) + x*(1 - x)*y\n"
         "time 0 .. 1, step 1 }\ntask t : s { unknown initial w; unknown e; " +
         (learns ? "learn first; " : "") + "minimise " + loss + " }\n";
}

const std::vector<Equation>& equations() {
  static const std::vector<Equation> all{
      {"lap(psi)", "y = 0"},
      {"lap(psi)", "y = zero_gradient", "periodic; walls", true},
      {"lap(psi)", "", "rings", true},
      {"lap(psi)", "all = 0", "walls"},
      {"lap(psi)", "x.low = 1, x.high = zero_gradient, y = gradient(0.3)", "walls"},
      {"lap(psi) - e*psi", "y = zero_gradient"},
      {"lap(psi) - k*psi", "", "rings"},
      {"div(k*grad(psi))", "y = 0"},
      {"div(k*grad(psi))", "y = zero_gradient", "periodic; walls", true},
      {"div(k*grad(psi))", "", "rings", true},
      {"e*psi - div(k*grad(psi))", "y = mixed(1, 0.5, 0.2)"},
      {"dx(dx(psi)) + 2*dy(dy(psi)) - psi", "", "rings"},
  };
  return all;
}

std::vector<double> found(const std::string& text) { return run_scene(text, "s").state.at("w"); }

double largest_apart(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b.at(i)));
  return most;
}

/// Without a guess the solver makes the same iterations from the same start.
TEST(Iterations, AreThoseOfTheSolver) {
  for (std::size_t tried = 0; const Equation& equation : equations()) {
    for (const int count : {3, 1}) {
      if (!is_tried(tried++, 2)) continue;
      const std::string n = std::to_string(count);
      const auto own = found(scene_of(equation, " after " + n + " iterations", "dx = central(2)"));
      const auto solver =
          found(scene_of(equation, "", "guess = none; preconditioner = none; solve = cg(1e-15, " + n + ", warn)"));
      EXPECT_LT(largest_apart(own, solver), 1e-13) << equation.operation << ", " << equation.sides << ", " << n;
    }
  }
}

/// Also from a guess, and with surplus iterations.
TEST(Iterations, ComeToTheSolution) {
  for (std::size_t count = 0; const Equation& equation : equations()) {
    if (!is_tried(count++, 3)) continue;
    const auto solution = found(scene_of(equation, "", "solve = direct"));
    for (const char* from : {" from first(w) after 60 iterations", " from 7 + k*w after 45 iterations"})
      EXPECT_LT(largest_apart(found(scene_of(equation, from, "dx = central(2)")), solution), 1e-11)
          << equation.operation << ", " << equation.sides << from;
  }
}

/// Wherever a solution may stand: intermediate fields are stored before the kernel that needs them. If the solution is
/// known only up to a constant, so is the result.
TEST(Iterations, StandWhereSolutionsDo) {
  const std::vector<std::string> uses{
      "psi",           "mean(psi^2)",        "lap(psi^2)",         "n(psi)",          "n(2*psi)",
      "n(n(psi) + w)", "mean(n(psi*w))*psi", "div(psi*grad(psi))", "integral(psi*w)", "psi*mean(lap(psi)^2, y)"};
  const auto state = [](const std::string& use, const std::string& after, bool is_event) {
    const std::string text =
        "network n(a) { real f64; padding x periodic, y zero; initial he, seed 1; conv 2, 3; tanh; conv out, 3 }\n"
        "model m { field w; solve lap(psi) - psi = -w for psi" +
        after + "; dt(w) = " + (is_event ? "0" : use) + " }\nscheme c { time = rk2; solve = direct }\n" +
        "scene s : m with c {\n" + axis("x", 4, ", periodic") + axis("y", 3, "") +
        "boundary w: y = 0\nboundary psi: y = 0\ninitial w = sin(2*pi*x)*(1 + y) + cos(5*y)\n" +
        (is_event ? "after step: w += " + use + "\n" : "") + "time 0 .. 1/4, step 1/8 }\n";
    return run_scene(text, "s").state.at("w");
  };
  for (const std::string& use : uses) {
    for (const bool is_event : {false, true}) {
      SCOPED_TRACE(use + (is_event ? " in an event" : " in an equation"));
      const auto found = state(use, " after 12 iterations", is_event), solution = state(use, "", is_event);
      for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], solution[i], 1e-10);
    }
  }
}

TEST(Iterations, ZeroOfThemAreTheGuess) {
  for (std::size_t count = 0; const Equation& equation : equations()) {
    if (!is_tried(count++, 4)) continue;
    const auto with = [&](const std::string& from) {
      return found(scene_of(equation, " from " + from + " after 0 iterations", "dx = central(2)"));
    };
    const std::vector<double> guess = with("k*w"), more = with("k*w + 5"), none = with("0*w");
    for (std::size_t i = 0; i < guess.size(); ++i) {
      EXPECT_NEAR(more[i] - guess[i], equation.is_singular ? 0 : 5, 1e-13) << equation.operation;
    }
    double sum = 0;
    for (std::size_t i = 0; i < guess.size(); ++i) sum += guess[i] - none[i];
    if (equation.is_singular) EXPECT_NEAR(sum, 0, 1e-12) << equation.operation;
  }
}

/// Through the right-hand side, coefficients of the operator, values at walls, the guess and its weights: tangent
/// against adjoint, and Taylor slopes.
TEST(Iterations, HaveDerivatives) {
  for (std::size_t count = 0; const Equation& equation : equations()) {
    for (const char* behind : {" from first(w) after 3 iterations", " from first(w) after 0 iterations",
                               " from e*k*w after 2 iterations", " after 4 iterations"}) {
      if (!is_tried(count++, 13)) continue;
      SCOPED_TRACE(equation.operation + ", " + equation.sides + behind);
      expect_certified(scene_of(equation, behind, "dx = central(2)"), true);
    }
  }
}

/// With the guess's residual as the loss: its gradient is that of the formula if both are known.
TEST(Iterations, OfAGuessAreTrainedOnTheResidual) {
  const Equation ring{"lap(psi)", "", "rings", true};
  const auto residual = task_gradient(
      scene_of(ring, " from first(w) after 0 iterations", "dx = central(2)", "mean((lap(psi) + w)^2) at t = 0"), "t");
  const auto formula = task_gradient(
      scene_of(ring, " after 1 iterations", "dx = central(2)", "mean((lap(first(w)) + w)^2) at t = 0"), "t");
  ASSERT_GT(residual.loss, 0);
  EXPECT_NEAR(residual.loss, formula.loss, 1e-12 * formula.loss);
  const std::vector<double>&a = residual.gradient.at("first"), &b = formula.gradient.at("first");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-11 * formula.loss) << i;
}

/// Also next to walls: iterations stop at a residual of pure rounding, with finite derivatives.
TEST(Iterations, EndWhereNothingIsLeft) {
  for (const Equation& equation : {equations()[1], equations()[5]}) {
    const auto solved = task_gradient(scene_of(equation, "", "solve = direct", "mean(psi^2)"), "t");
    const auto many =
        task_gradient(scene_of(equation, " from first(w) after 40 iterations", "dx = central(2)", "mean(psi^2)"), "t");
    EXPECT_NEAR(many.loss, solved.loss, 1e-11 * solved.loss);
    const std::vector<double>&a = many.gradient.at("w"), &b = solved.gradient.at("w");
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-8) << equation.operation << i;
  }
}

/// The treatment of the mean is decided by the text: a value that makes an operator singular is refused.
TEST(Iterations, MayNotBeSingularByAValue) {
  for (const auto& [value, is_fine] : {std::pair{"0", false}, {"2", true}, {"1e-3", true}}) {
    const std::string text =
        std::string("model m { field w; param a = ") + value +
        "; solve lap(q) - a*q = -w for q after 3 iterations; dt(w) = q }\n"
        "scene s : m { grid x = 0 .. 1, cells 6, periodic; initial w = sin(2*pi*x); time 0 .. 0.1, "
        "step 0.1 }\n";
    const SourceFile source("t.dpde", text);
    DiagnosticSink sink;
    driver::CompileOptions options;
    options.selection.keeps_params = true;
    EXPECT_EQ(driver::compile(source, options, sink).has_value(), is_fine) << value;
    if (!is_fine) {
      ASSERT_EQ(sink.all().size(), 1U);
      EXPECT_EQ(sink.all()[0].kind->code, std::string("E0567"));
    }
  }
}

}  // namespace
}  // namespace dpde::testing
