// SPDX-License-Identifier: Apache-2.0
// Solves that start from results of the step before: fewer iterations, the same solution and derivatives, and no memory
// of a run other than its states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/flow_texts.h"
#include "support/opened_scene.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Fluid driven around an obstacle; `scheme` has further lines of the scheme.
std::string disc_in_channel(const std::string& scheme) {
  return flow_around_a_solid + std::string("scheme c { ") + scheme + R"( }
scene s : m with c {
  grid x = 0 .. 1, cells 24, periodic
  grid y = 0 .. 1, cells 20
  boundary u: y = (0, 0)
  nu = 0.02
  solid = (x - 0.5)^2 + (y - 0.5)^2 < 0.03
  initial u.x = 4*y*(1 - y)
  initial u.y = 0
  time 0 .. 0.2, step 1/100
}
task t : s {
  unknown initial u
  unknown nu
  minimise mean(u.x^2) over time
  minimise mean(u.y^3) over time
}
)";
}

std::string uneven_bed(const std::string& scheme) {
  return flow_over_an_uneven_bed + std::string("scheme c { ") + scheme + R"( }
scene s : m with c {
  grid x = 0 .. 1, cells 24
  grid y = 0 .. 1, cells 20
  boundary w: all = 0
  boundary psi: all = 0
  nu = 0.01
  k = 1 + 0.5*sin(7*x)*cos(5*y)
  initial w = 10*sin(pi*x)*sin(2*pi*y)
  time 0 .. 0.2, step 1/100
}
task t : s {
  unknown initial w
  unknown nu
  minimise mean(w^3) over time
  minimise mean(psi^2)
}
)";
}

OpenedScene opened_warm(const std::string& text, const char* name, int slots = 0, int threads = 1) {
  OpenWith with{.adjoint = std::string(name) == "t"};
  with.session.slots = slots;
  with.session.threads = threads;
  return {text, name, with};
}

struct Begun {
  std::int64_t iterations = 0;
  int most = 0;
  std::vector<std::vector<double>> states;
};
Begun begun(const std::string& text) {
  const OpenedScene opened = opened_warm(text, "s");
  const auto& session = opened.session;
  Begun result;
  if (!session) return result;
  session->rollout().run();
  for (const SolveNote& note : session->rollout().solve_notes()) {
    result.iterations += note.iterations;
    result.most = std::max(result.most, note.most_iterations);
  }
  for (std::size_t i = 0; i < session->problem().states.size(); ++i)
    result.states.push_back(session->final_state(static_cast<int>(i)));
  return result;
}

double states_apart(const Begun& a, const Begun& b) {
  double most = 0;
  for (std::size_t s = 0; s < std::min(a.states.size(), b.states.size()); ++s) {  // the last may be a solution
    for (std::size_t i = 0; i < a.states[s].size(); ++i)
      most = std::max(most, std::abs(a.states[s][i] - b.states.at(s).at(i)));
  }
  return most;
}

TEST(WarmStart, TakesFewerIterationsToTheSameSolution) {
  for (const char* method : {"cg(1e-7)", "bicgstab(1e-7)", "gmres(1e-7)"}) {
    const std::string solve = std::string("solve = ") + method;
    for (const auto& scene : {disc_in_channel, uneven_bed}) {
      const Begun cold = begun(scene(solve + "; guess = none")), warm = begun(scene(solve + "; guess = last"));
      ASSERT_FALSE(cold.states.empty());
      EXPECT_LT(static_cast<double>(warm.iterations), 0.8 * static_cast<double>(cold.iterations)) << method;
      EXPECT_LE(warm.most, cold.most) << method;
      EXPECT_LT(states_apart(cold, warm), 1e-5) << method;
      EXPECT_NE(states_apart(cold, warm), 0) << method;
      EXPECT_EQ(states_apart(warm, begun(scene(solve))), 0) << method << ": it is the default";
    }
  }
}

/// The best combination of the last two solutions is at least as accurate as the best multiple of the last one.
TEST(WarmStart, ExtrapolationTakesFewerIterationsStill) {
  const auto iterations = [](const std::string& text) { return static_cast<double>(begun(text).iterations); };
  const std::string solve = "solve = cg(1e-6); preconditioner = none; guess = ";
  const double none = iterations(uneven_bed(solve + "none")), last = iterations(uneven_bed(solve + "last")),
               two = iterations(uneven_bed(solve + "extrapolate"));
  EXPECT_GT(two, 0);
  EXPECT_LT(last, 0.8 * none);
  EXPECT_LT(two, 0.8 * last);
  const Begun flow = begun(disc_in_channel(solve + "last")), other = begun(disc_in_channel(solve + "extrapolate"));
  EXPECT_LT(states_apart(flow, other), 1e-4);
  EXPECT_LT(static_cast<double>(other.iterations), 1.05 * static_cast<double>(flow.iterations));
}

/// The right-hand side has four waves; plain conjugate gradients need one iteration for each, and none for waves in the
/// start value. A guess of the scheme replaces the model's.
TEST(WarmStart, BeginsWithFormulas) {
  const auto most = [](const std::string& from, const std::string& guess = "automatic") {
    return begun("model m { field w; solve lap(psi) - psi = -w for psi" + from +
                 "; dt(w) = 1e-12*psi }\nscheme c { solve = cg(1e-8); preconditioner = none; guess = " + guess +
                 " }\nscene s : m with c { grid x = 0 .. 1, cells 12, periodic; grid y = 0 .. 1, cells 10, periodic\n"
                 "  initial w = 1 + sin(2*pi*x) + cos(4*pi*y) + sin(4*pi*x); time 0 .. 0.02, step 0.01 }\n")
        .most;
  };
  EXPECT_EQ(most(""), 4);
  EXPECT_EQ(most(" from 1"), 3);
  EXPECT_EQ(most(" from 2*sin(2*pi*x), cos(4*pi*y), 7 + 0*w"), 1);
  EXPECT_EQ(most(" from 1, sin(2*pi*x), cos(4*pi*y), sin(4*pi*x)"), 0);
  EXPECT_EQ(most(" from 1", "none"), 4);
  EXPECT_EQ(most(" from cos(2*pi*x), 0, w"), 4) << "what is of no use costs nothing";
}

/// A vector that a singular operator maps to rounding is no start value, however large.
TEST(WarmStart, NullSpacesAreNoStarts) {
  const auto iterations = [](const std::string& method, const std::string& from) {
    const Begun run =
        begun("model m { field w; solve lap(psi) = -w for psi" + from +
              "; dt(w) = 1e-12*psi }\nscheme c { solve = " + method +
              "(1e-8) }\nscene s : m with c { grid x = 0 .. 1, cells 24, periodic; grid y = 0 .. 1, cells 20\n"
              "  boundary psi: y = zero_gradient; boundary w: y = zero_gradient; initial w = sin(2*pi*x) + x*y; time 0 "
              ".. 0.02, step 0.01 }\n");
    return run.states.empty() ? 0 : run.most;
  };
  for (const std::string method : {"cg", "multigrid", "bicgstab", "gmres"}) {
    const int cold = iterations(method, "");
    EXPECT_GT(cold, 0) << method;
    for (const std::string from : {" from 1", " from 1 + 1e-9*w", " from 1e6 + w", " from 1, 1e9, w"}) {
      const int warm = iterations(method, from);
      EXPECT_GT(warm, 0) << method << from;
      EXPECT_LE(warm, cold + 1) << method << from;
    }
  }
}

/// No derivative goes through a start value, wherever the solve is: gradients are those of solves from 0.
TEST(WarmStart, StartsHaveNoPartInDerivatives) {
  const std::string network =
      "network first(r) -> g { real f64; padding x periodic, y periodic; initial he, seed 1; "
      "conv 4, 3; tanh; conv out, 3 }\n";
  const auto gradient = [&](const std::string& model, const std::string& scene, const std::string& loss) {
    return task_gradient(
               network + "model m { vector u on faces; field w, p; param e = 1.2; " + model +
                   " }\nscheme c { time = rk2; solve = cg(1e-13, 900); preconditioner = none }\n"
                   "scene s : m with c { grid x = 0 .. 1, cells 6, periodic; grid y = 0 .. 1, cells 5, periodic\n"
                   "  initial w = 1 + 0.3*sin(2*pi*x); initial u = (cos(2*pi*y), 0.5*sin(2*pi*x)); " +
                   scene +
                   "time 0 .. 0.06, step 0.02 }\n"
                   "task t : s { unknown initial w; unknown e; minimise " +
                   loss + " }\n",
               "t")
        .gradient;
  };
  const std::string rest = "dt(u) = 0.1*lap(u) - grad(p) + (0, 1)*interpolate(w); ";
  const std::string constraint = "0 = div(u) gives p", solve = "solve lap(psi) - e*psi = -w for psi";
  const auto both = [&](const std::string& starts) { return std::pair{rest + constraint + starts, solve + starts}; };
  for (const std::string& starts : {" from first(w)", " from w^2, dx(w)", " from first(e*w + div(u)), 0*w"}) {
    for (const auto& [scene, loss] : {std::pair{"", "mean(psi*w) + mean(dot(u, u))"},
                                      {"every 0.02: w += 0.1*psi; ", "mean(w^2) + mean(dot(u, u))"}}) {
      const auto text = [&](const std::string& with) {
        const auto [flow, declared] = both(with);
        return declared + "; dt(w) = 0.3*psi - 0.1*w; " + flow;
      };
      const auto cold = gradient(text(""), scene, loss), warm = gradient(text(starts), scene, loss);
      ASSERT_EQ(cold.size(), 2U) << starts << scene;
      ASSERT_EQ(warm.size(), 2U) << starts << scene;
      for (const auto& [name, values] : cold) {
        for (std::size_t i = 0; i < values.size(); ++i)
          EXPECT_NEAR(warm.at(name)[i], values[i], 1e-9 * std::abs(values[i]) + 1e-12) << starts << scene << name;
      }
    }
  }
}

/// A quantity that acts only through a start value cannot be an unknown: its gradient would silently be 0. This applies
/// to models and hand-written programs; with any other path to the loss it is allowed.
TEST(WarmStart, UnknownsOfStartsAloneAreRefused) {
  const std::string layers = " { real f64; padding x periodic; initial he, seed 1; conv 2, 3; conv out, 3 }\n";
  const auto code = [&](const std::string& from, const std::string& unknown, const std::string& loss) {
    return code_refused(
        "network first(r) -> g" + layers + "model m { field w; param a; solve lap(psi) - psi = -w for psi from " +
        from +
        "; dt(w) = psi }\nscheme c { time = euler; solve = cg; preconditioner = none }\n"
        "scene s : m with c { grid x = 0 .. 1, cells 6, periodic; a = 2; initial w = sin(2*pi*x); time 0 .. 0.2, step "
        "0.1 }\ntask t : s { " +
        unknown + "; minimise " + loss + " }\n");
  };
  EXPECT_EQ(code("first(w)", "learn first", "mean(psi^2)"), "E0601");
  EXPECT_EQ(code("first(w)", "learn first", "mean(w^2)"), "E0601");
  EXPECT_EQ(code("a*w", "unknown a", "mean(psi^2)"), "E0601");
  EXPECT_EQ(code("first(a*w)", "unknown initial w; unknown a", "mean(psi^2)"), "E0601");
  EXPECT_EQ(code("first(w)", "learn first", "mean((lap(first(w)) + w)^2)"), "");
  EXPECT_EQ(code("first(w) after 2 iterations", "learn first", "mean(psi^2)"), "");
  EXPECT_EQ(code("a*w", "unknown a", "mean(psi^2) + 1e-3*a^2"), "");

  const std::string by_hand =
      "network first(1) -> 1" + layers +
      "kernel right(w: field, out r: field) { r = -w }\n"
      "kernel image(p: field halo 1, hx: param, out q: field) { q = (p[-1] - 2*p + p[+1])/hx^2 - p }\n"
      "kernel next(w, p: field, out v: field) { v = w + 0.1*p }\n"
      "kernel kept(g: field, out h: field) { h = g }\n"
      "program step { run right; apply first(r) to g; solve q = r for p from g by cg { fill p x = periodic; run image "
      "}; run next";
  const auto scene = [](const std::string& more) {
    return "scene s : step { grid x = 0 .. 1, cells 6, periodic; initial w = sin(2*pi*x); " + more +
           "time 0 .. 0.2, step 0.1 }\ntask t : s { learn first; minimise mean(w^2) }\n";
  };
  EXPECT_EQ(code_refused(by_hand + "; swap w, v }\n" + scene("")), "E0601");
  EXPECT_EQ(code_refused(by_hand + "; run kept; swap w, v; swap k, h }\n" + scene("initial k = 0; ")), "");
}

/// All iterative methods with each preconditioner give the same solution; plain ones need more iterations.
TEST(Preconditioners, ComeToTheSameSolution) {
  for (const auto& scene : {disc_in_channel, uneven_bed}) {
    const Begun direct = begun(scene("solve = direct"));
    for (const std::string method : {"cg", "bicgstab", "gmres"}) {
      const std::string solve = "guess = none; solve = " + method + "(1e-10, 2000); preconditioner = ";
      const Begun plain = begun(scene(solve + "none")), cycles = begun(scene(solve + "multigrid"));
      ASSERT_FALSE(plain.states.empty()) << method;
      ASSERT_FALSE(cycles.states.empty()) << method;
      EXPECT_LT(states_apart(direct, plain), 1e-7) << method;
      EXPECT_LT(states_apart(direct, cycles), 1e-7) << method;
      EXPECT_GT(plain.most, 3 * cycles.most) << method;
    }
  }
}

/// Direct methods ignore guesses.
TEST(WarmStart, ChangesNothingOfDirectMethods) {
  const Begun cold = begun(disc_in_channel("solve = direct; guess = none"));
  EXPECT_EQ(states_apart(cold, begun(disc_in_channel("solve = direct; guess = last"))), 0);
  EXPECT_EQ(cold.iterations, 0);
}

TEST(WarmStart, HasTheDerivativesOfTheSolution) {
  expect_certified(disc_in_channel("time = rk2; solve = cg(1e-13); guess = last"), true);
  if (testing::is_thorough()) expect_certified(uneven_bed("time = rk2; solve = cg(1e-13); guess = last"), true);
  expect_certified(uneven_bed("time = ab2; solve = cg(1e-13); guess = last"), true);
  if (testing::is_thorough())
    expect_certified(disc_in_channel("time = rk2; solve = cg(1e-13, 900); guess = extrapolate; preconditioner = none"),
                     true);
  expect_certified(uneven_bed("time = rk2; solve = gmres(1e-13, 900); guess = extrapolate; preconditioner = none"),
                   true);
}

/// Forward, tangent and adjoint solves by cycles with each smoother; the gradient equals that of sparse factorisations.
TEST(Smoothers, HaveTheDerivativesOfTheSolution) {
  const auto gradient_by = [](const std::string& scheme) {
    return task_gradient(uneven_bed("time = rk2; guess = none; " + scheme), "t").gradient.at("w");
  };
  const std::vector<double> direct = gradient_by("solve = direct");
  for (std::size_t count = 0; const std::string smoother : {"red_black", "jacobi", "chebyshev"}) {
    for (const char* method : {"multigrid", "cg", "bicgstab"}) {
      if (!testing::is_tried(count++, 2)) continue;
      const std::string scheme = std::string("solve = ") + method + "(1e-13); smoother = " + smoother;
      const std::vector<double> gradient = gradient_by(scheme);
      for (std::size_t i = 0; i < direct.size(); ++i) EXPECT_NEAR(gradient[i], direct[i], 1e-12) << scheme;
    }
    expect_certified(uneven_bed("time = rk2; solve = multigrid(1e-13); smoother = " + smoother), true);
    expect_certified(disc_in_channel("time = rk2; solve = cg(1e-13); smoother = " + smoother), true);
  }
}

TEST(Smoothers, AreSaidWithTheMethod) {
  const OpenedScene opened = opened_warm(uneven_bed("time = rk2; solve = multigrid; smoother = chebyshev"), "s");
  const auto& session = opened.session;
  ASSERT_TRUE(session);
  session->rollout().run();
  EXPECT_NE(session->rollout().solve_notes().front().reason.find("cycles, smoothed by a polynomial of Chebyshev"),
            std::string::npos);
}

/// Bit-identical for any number of checkpoints and threads: start values of solves are states.
TEST(WarmStart, CheckpointsAndThreadsChangeNothing) {
  using Scene = std::string (*)(const std::string&);
  for (const auto& [scene, guess] : {std::pair<Scene, const char*>{disc_in_channel, "last"},
                                     {uneven_bed, "last"},
                                     {disc_in_channel, "extrapolate"},
                                     {uneven_bed, "extrapolate"}}) {
    Eigen::VectorXd first;
    for (const auto& [slots, threads] : {std::pair{0, 1}, {1, 1}, {2, 1}, {3, 3}}) {
      OpenedScene opened =
          opened_warm(scene("time = rk2; solve = cg(1e-5); guess = " + std::string(guess)), "t", slots, threads);
      const auto inverse = opened.inverse();
      ASSERT_TRUE(inverse);
      Eigen::VectorXd gradient(inverse->size());
      inverse->value_and_gradient(inverse->start(), gradient);
      if (first.size() == 0) first = gradient;
      EXPECT_TRUE(gradient == first) << slots << " slots, " << threads << " threads";
    }
  }
}

/// A run continued from the states of a step in its middle ends bit-identically.
TEST(WarmStart, GoesOnFromTheStates) {
  const OpenedScene opened = opened_warm(disc_in_channel("time = rk2; solve = cg(1e-5); guess = extrapolate"), "s");
  const auto& session = opened.session;
  ASSERT_TRUE(session);
  Rollout& rollout = session->rollout();
  std::vector<std::vector<double>> middle;
  rollout.run({7, [&](const Snapshot& snapshot) {
                 if (snapshot.step == 7) middle = opened.states_of(snapshot);
               }});
  const std::vector<double> end = session->final_state(0);
  ASSERT_FALSE(middle.empty());
  for (std::size_t s = 0; s < middle.size(); ++s) rollout.initial(static_cast<int>(s)).copy_in(middle[s]);
  rollout.run({}, 7);
  EXPECT_EQ(end, session->final_state(0));
}

}  // namespace
}  // namespace dpde::testing
