// SPDX-License-Identifier: Apache-2.0
// Networks as preconditioners: solution and derivatives do not depend on the network; differentiated iterations do, for
// training.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "source/render.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "support/opened_scene.h"
#include "support/setting.h"
#include "syntax/parser.h"

namespace dpde::testing {
namespace {

struct Box {
  std::string operation, sides, axes = "rings";  // rings, channel or walls
  bool is_symmetric = true;
};

const std::vector<Box>& boxes() {
  static const std::vector<Box> all{
      {"lap(psi)", ""},
      {"lap(psi)", "y = zero_gradient", "channel"},
      {"lap(psi)", "x.low = 1, x.high = zero_gradient, y = gradient(0.3)", "walls"},
      {"div(k*grad(psi))", "y = 0", "channel"},
      {"e*psi - div(k*grad(psi))", "y = mixed(1, 0.5, 0.2)", "channel"},
      {"lap(psi) - e*dx(psi)", "all = 0", "walls", false},
  };
  return all;
}

std::string network_of(const Box& box, const std::string& layers, const std::string& real = "f64") {
  const char* x = box.axes == "walls" ? "zero" : "periodic";
  const char* y = box.axes == "rings" ? "periodic" : "zero";
  return "network near(r, c) -> z { real " + real + "; padding x " + x + ", y " + y + "; initial he, seed 3; " +
         layers + " }\n";
}
const std::string bent = "conv 3, 3; tanh; conv out, 3";

std::string box_text(const Box& box, const std::string& behind, const std::string& scheme,
                     const std::string& layers = bent, const std::string& network_real = "f64") {
  const std::string of_w = box.axes == "walls" ? "all" : "y";
  const std::string x = box.axes == "walls" ? "" : ", periodic", y = box.axes == "rings" ? ", periodic" : "";
  const bool learns = behind.find("after") != std::string::npos && behind.find("near") != std::string::npos;
  return network_of(box, layers, network_real) + "model m { field w; coefficient k; param e = 0.7; solve " +
         box.operation + " = -w for psi" + behind + "; dt(w) = psi }\nscheme c { time = euler; " + scheme +
         " }\nscene s : m with c {\n" + "grid x = 0 .. 1, cells 6" + x + "\ngrid y = 0 .. 1, cells 5" + y + "\n" +
         (y.empty() ? "boundary w: " + of_w + " = zero_gradient\nboundary psi: " + box.sides + "\n" : "") +
         "k = 1.3 + 0.5*sin(2*pi*x)*cos(3*y)\ninitial w = sin(2*pi*x)*(1 + y) + cos(5*y) + x*(1 - x)*y\n"
         "time 0 .. 1, step 1 }\ntask t : s { unknown initial w; unknown e; " +
         (learns ? "learn near; " : "") + "minimise mean(psi^2) + mean(w*psi) }\n";
}
const std::string by_network = " preconditioner near(residual, k)";

double box_apart(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b.at(i)));
  return a.empty() ? INFINITY : most;
}

/// Solvers x boundaries x precisions x networks, with each back end.
TEST(NetworkPreconditioners, LeaveTheSolutionAsItIs) {
  for (std::size_t count = 0, tried = 0; const Box& box : boxes()) {
    for (const char* real : {"f64", "f32"}) {
      if (!is_tried(tried++, 3)) continue;
      const auto found = [&](const std::string& behind, const std::string& scheme, const std::string& layers,
                             driver::Backend backend) {
        return run_scene(box_text(box, behind, std::string("real = ") + real + "; " + scheme, layers, real), "s", {},
                         backend)
            .state.at("w");
      };
      const auto solution = found("", "solve = direct", bent, driver::Backend::jit);
      const double rounding = std::string(real) == "f64" ? 1e-9 : 1e-4;
      for (const char* method : {"cg", "gmres"}) {
        if (!box.is_symmetric && method == std::string("cg")) continue;
        const std::string scheme =
            std::string("solve = ") + method + (std::string(real) == "f64" ? "(1e-12, 900)" : "(1e-6, 900)");
        for (const std::string& layers :
             {bent, std::string("conv out, 1, initial = zero"), std::string("conv out, 3; scale -1e-20")})
          EXPECT_LT(box_apart(found(by_network, scheme, layers, driver::Backend::jit), solution), rounding)
              << box.operation << ", " << box.sides << ", " << method << ", " << real << ", " << layers;
        EXPECT_LT(box_apart(found(by_network, scheme, bent, driver::Backend::interpreter), solution), rounding);
        if (count++ == 1 || is_thorough())
          EXPECT_EQ(box_apart(found(by_network, scheme, bent, driver::Backend::cpp),
                              found(by_network, scheme, bent, driver::Backend::jit)),
                    0);
      }
    }
  }
}

TEST(NetworkPreconditioners, HaveTheDerivativesOfTheSolution) {
  for (std::size_t count = 0; const Box& box : boxes()) {
    if (!is_tried(count++, 3)) continue;
    for (const char* method : {"cg", "gmres"}) {
      if (!box.is_symmetric && method == std::string("cg")) continue;
      SCOPED_TRACE(box.operation + ", " + box.sides + " by " + method);
      expect_certified(box_text(box, by_network, std::string("solve = ") + method + "(1e-14, 900)"), true);
    }
  }
}

/// The solver's iterations equal the differentiated ones.
TEST(NetworkPreconditioners, AreTheSameWhereIterationsAreDifferentiated) {
  for (std::size_t tried = 0; const Box& box : boxes()) {
    if (!box.is_symmetric) continue;
    for (const int count : {3, 1}) {
      if (!is_tried(tried++, 2)) continue;
      const std::string n = std::to_string(count);
      const auto found = [&](const std::string& behind, const std::string& scheme) {
        return run_scene(box_text(box, behind, scheme), "s").state.at("w");
      };
      const auto own = found(by_network + " after " + n + " iterations", "dx = central(2)");
      const auto solver = found(by_network, "guess = none; solve = cg(1e-15, " + n + ", warn)");
      const auto plain = found(" after " + n + " iterations", "dx = central(2)");
      EXPECT_LT(box_apart(own, solver), 1e-11) << box.operation << ", " << box.sides << ", " << n;
      EXPECT_GT(box_apart(own, plain), 1e-6) << box.operation << ", " << box.sides << ", " << n;
    }
  }
}

/// Also by the weights; also if the network is useless, and for a zero residual.
TEST(NetworkPreconditioners, HaveDerivativesThroughIterations) {
  for (std::size_t count = 0; const Box& box : boxes()) {
    if (!box.is_symmetric) continue;
    for (const std::string& behind :
         {by_network + " after 2 iterations", " from k*w" + by_network + " after 3 iterations"}) {
      if (!is_tried(count++, 5)) continue;
      SCOPED_TRACE(box.operation + ", " + box.sides + behind);
      const auto certificate = certificate_of(box_text(box, behind, "dx = central(2)"), true);
      ASSERT_TRUE(certificate);
      EXPECT_TRUE(certificate->passed() && certificate->second && certificate->second->passed());
      EXPECT_LT(certificate->worst(), 1e-11);  // on the smallest grids iterations continue on rounding errors
      EXPECT_NEAR(certificate->slope.value_or(0), 2, 0.05);
    }
    if (box.axes == "channel" && !is_thorough()) continue;
    const std::string none = "conv out, 1, initial = zero";  // its directions are useless
    const auto many =
        run_scene(box_text(box, by_network + " after 70 iterations", "dx = central(2)", none), "s").state.at("w");
    EXPECT_LT(box_apart(many, run_scene(box_text(box, "", "solve = direct"), "s").state.at("w")), 1e-9)
        << box.operation;
  }
}

/// A network with weights of multilevel smoothing (Bramble, Pasciak and Xu 1990).
std::string wide_box(const std::string& behind, const std::string& scheme) {
  std::string levels;  // means over 2, 4, 8, ... cells, as wide as the operator requires
  for (int level = 0; level < 5; ++level) levels = "residual { mean_pool 2; " + levels + "scale 2; upsample 2 }; ";
  return "network near(r) -> z { real f64; padding x periodic, y zero; " + levels +
         "conv out, 1, bias = 0, initial = zero }\n"
         "model m { field w; solve lap(psi) = -w for psi" +
         behind + "; dt(w) = 1e-9*psi }\nscheme c { time = euler; " + scheme +
         " }\nscene s : m with c { grid x = 0 .. 1, cells 32, periodic; grid y = 0 .. 1, cells 32\n"
         "  boundary w: y = 0; boundary psi: y = 0\n  initial w = random_field(seed = 2, lowest = 1, highest = 9)\n"
         "  time 0 .. 0.02, step 0.01 }\ntask t : s { unknown initial w; minimise mean(psi^2) }\n";
}

std::int64_t iterations_of(const std::string& text, bool back) {
  const OpenedScene opened(text, "t", {.adjoint = true});
  if (opened.session == nullptr) return 0;
  for (auto& [name, weights] : opened.session->workspace().weights()) std::ranges::fill(weights.values, 1.0);
  Rollout& rollout = opened.session->rollout();
  rollout.update_weights();
  rollout.gradient();
  std::int64_t total = 0;
  for (const SolveNote& note : back ? rollout.adjoint_solve_notes() : rollout.solve_notes()) total += note.iterations;
  return total;
}

TEST(NetworkPreconditioners, ThatAreGoodSaveIterations) {
  for (const bool back : {false, true}) {
    const std::string scheme = "guess = none; solve = cg(1e-8, 900)";
    const auto plain = iterations_of(wide_box("", scheme + "; preconditioner = none"), back);
    const auto own = iterations_of(wide_box(" preconditioner near(residual)", scheme), back);
    EXPECT_GT(own, 0) << back;
    EXPECT_LT(static_cast<double>(own), 0.7 * static_cast<double>(plain)) << back;
    const auto instead =
        iterations_of(wide_box(" preconditioner near(residual)", scheme + "; preconditioner = none"), back);
    EXPECT_EQ(instead, plain) << "the scheme's takes its place";
  }
}

/// A quantity that acts only through a preconditioner cannot be an unknown.
TEST(NetworkPreconditioners, AreNoUnknownsOfSolutions) {
  const Box ring = boxes().front();
  const auto code = [&](const std::string& behind, const std::string& unknown, const std::string& loss,
                        const std::string& scheme = "solve = cg") {
    std::string text = box_text(ring, behind, scheme);
    text.resize(text.find("task t"));
    return code_refused(text + "task t : s { " + unknown + "; minimise " + loss + " }\n");
  };
  EXPECT_EQ(code(by_network, "learn near", "mean(psi^2)"), "E0601");
  EXPECT_EQ(code(by_network, "learn near", "mean(w^2)"), "E0601");
  EXPECT_EQ(code(" preconditioner near(residual, e*w)", "unknown initial w; learn near", "mean(psi^2)"), "E0601");
  EXPECT_EQ(code(" preconditioner near(residual, e*w)", "unknown initial w; unknown e", "mean(psi^2)"), "E0601");
  EXPECT_EQ(code(by_network + " after 2 iterations", "learn near", "mean(psi^2)"), "");
  for (const std::string scheme : {"direct", "cg; preconditioner = none"})
    EXPECT_EQ(code(by_network, "learn near", "mean(psi^2)", "solve = " + scheme), "E0381") << scheme;
  for (const char* word : {"near", "none", "multigrid", "naer"})
    EXPECT_EQ(code(" preconditioner " + std::string(word), "unknown initial w", "mean(psi^2)"), "E0567") << word;
  EXPECT_EQ(code(by_network, "learn near", "mean(near(w, k)^2)"), "");
}

/// The emitted text reads back as the same program.
TEST(NetworkPreconditioners, ReadBack) {
  for (const std::string& behind : {by_network, by_network + " after 2 iterations"}) {
    const SourceFile source("t.dpde", box_text(boxes()[3], behind, "solve = cg(1e-9)"));
    const auto made = compiled(source, {.selection = {"t"}, .adjoint = true});
    ASSERT_TRUE(made);
    const std::string text = stencil::print(made->stencil);
    const SourceFile printed("p.dpde", text);
    DiagnosticSink sink;
    const stencil::Module again = stencil::from_ast(ast::parse(printed, sink), sink);
    EXPECT_FALSE(sink.has_errors()) << all_messages(printed, sink);
    EXPECT_EQ(stencil::print(again), text);
    const bool is_solved = text.find("preconditioner near(psi_residual, k) to psi_towards") != std::string::npos;
    EXPECT_EQ(is_solved, behind == by_network);
  }
}

/// A flow around an obstacle with a preconditioned constraint: the same flow, for any number of checkpoints and
/// threads.
std::string disc_solved_by(const std::string& behind, const std::string& scheme) {
  return "network near(r) -> z { padding x periodic, y zero; initial he, seed 3; conv 4, 3; leaky_relu; conv out, 3 }\n"
         "model m { vector u on faces; field p; mask solid\n  dt(u) = -advect(u, u) - grad(p) + 0.02*lap(u)\n"
         "  0 = div(u) gives p" +
         behind + "\n  u = 0 inside solid }\nscheme c { time = rk2; " + scheme +
         " }\nscene s : m with c { grid x = 0 .. 1, cells 24, periodic; grid y = 0 .. 1, cells 20\n"
         "  solid = (x - 0.5)^2 + (y - 0.5)^2 < 0.03; boundary u: y = (0, 0); initial u = (4*y*(1 - y), 0)\n"
         "  time 0 .. 0.1, step 1/100 }\ntask t : s { unknown initial u; minimise mean(u.x^2) over time }\n";
}

TEST(NetworkPreconditioners, OfConstraintsBesideObstacles) {
  const std::string near = " preconditioner near(residual)";
  const auto plain = task_gradient(disc_solved_by("", "solve = direct"), "t");
  for (const char* guess : {"none", "last", "extrapolate"}) {
    const auto own = task_gradient(disc_solved_by(near, "solve = cg(1e-11, 900); guess = " + std::string(guess)), "t");
    EXPECT_NEAR(own.loss, plain.loss, 1e-8 * plain.loss) << guess;
    EXPECT_LT(box_apart(own.gradient.at("u.x"), plain.gradient.at("u.x")), 1e-8) << guess;
  }
  Eigen::VectorXd first;
  for (const auto& [slots, threads] : {std::pair{0, 1}, {2, 1}, {3, 3}}) {
    OpenWith with{.adjoint = true};
    with.session.slots = slots;
    with.session.threads = threads;
    OpenedScene opened(disc_solved_by(near, "solve = cg(1e-5, 900)"), "t", with);
    const auto inverse = opened.inverse();
    ASSERT_TRUE(inverse);
    Eigen::VectorXd gradient(inverse->size());
    inverse->value_and_gradient(inverse->start(), gradient);
    if (first.size() == 0) first = gradient;
    EXPECT_TRUE(gradient == first) << slots << " slots, " << threads << " threads";
  }
}

}  // namespace
}  // namespace dpde::testing
