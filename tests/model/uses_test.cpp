// SPDX-License-Identifier: Apache-2.0
// What a problem reads, as every walk over it has to see it: one thing, as a solve or a jump at a seam, in each place
// where a formula may stand.
#include "model/uses.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "model/analyse/solves.h"
#include "model/build.h"
#include "model_support.h"
#include "support/assert.h"

namespace dpde::model {
namespace {

std::vector<UseKind> all_kinds() {
  std::vector<UseKind> kinds;
  for (int kind = 0; kind <= static_cast<int>(UseKind::stated_operator); ++kind)
    kinds.push_back(static_cast<UseKind>(kind));
  return kinds;
}

/// Where a person writes a formula of this kind, as the texts below call the place; "" where formulas of states have no
/// place of that kind, or it has another's.
std::string slot_of(UseKind kind) {
  switch (kind) {
    case UseKind::equation: return "equation";
    case UseKind::constraint: return "constraint";
    case UseKind::held_value: return "held";
    case UseKind::event: return "event";
    case UseKind::courant_rate: return "speed";
    case UseKind::observable: return "observable";
    case UseKind::output: return "output";
    case UseKind::loss: return "loss";
    case UseKind::test: return "test";
    case UseKind::potential:   // made of the constraint
    case UseKind::correction:  // and of what is held
    case UseKind::test_field:  // of runs of trajectories alone, which have a file
    case UseKind::held_where:  // of coordinates, parameters, t
    case UseKind::initial:
    case UseKind::coefficient:
    case UseKind::control:
    case UseKind::control_start:
    case UseKind::unknown_start:
    case UseKind::exact:
    case UseKind::boundary_value:
    case UseKind::boundary_weight:
    case UseKind::stretch_map:
    case UseKind::metric:
    case UseKind::stated_operator: return "";
  }
  unreachable("kind of use");
}

/// What is put into the places, and what it needs.
struct Thing {
  std::string formula;
  std::string before = "", in_model = "", scheme = "", in_scene = "";
  std::string grid = "  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 1, cells 8, periodic\n";
};

/// A task t that has the formula in the place of this name, and numbers in the others.
std::string text_with_thing(const Thing& thing, const std::string& slot) {
  const auto at = [&](const std::string& name) { return name == slot ? thing.formula : std::string("0.5"); };
  const bool has_constraint = slot == "constraint";
  return thing.before + "model m {\n  field u, v\n  mask solid\n" + thing.in_model +
         (has_constraint ? "  vector w on faces\n  field p\n  dt(w) = -w - grad(p)\n  0 = div(w) + " +
                               at("constraint") + " gives p\n"
                         : "") +
         "  dt(u) = -u*" + at("equation") + "\n  dt(v) = 0\n  v = " + at("held") + " inside solid\n  let q = u*" +
         at("output") + "\n}\nscheme k { " + thing.scheme + " }\nscene s : m with k {\n" + thing.grid + thing.in_scene +
         "  solid = x < 0.5\n  initial u = 1\n  initial v = 0\n" + (has_constraint ? "  initial w = 0\n" : "") +
         "  time 0 .. 0.1, step 0.05, courant 0.5, speed 1 + |" + at("speed") + "|\n  after step: u = u*" +
         at("event") + "\n  observe seen = mean(u*" + at("observable") + ")\n  output q\n}\n" +
         "task t : s {\n  unknown initial u\n  minimise mean((u*" + at("loss") + ")^2)\n  test miss = mean(u*" +
         at("test") + ")\n}\n";
}

struct SlotCase {
  UseKind kind;
  std::string slot;
};
std::vector<SlotCase> slots() {
  std::vector<SlotCase> found;
  for (const UseKind kind : all_kinds()) {
    if (const std::string slot = slot_of(kind); !slot.empty()) found.push_back({kind, slot});
  }
  return found;
}

std::string codes(const Outcome& outcome) {
  std::string all;
  for (const Diagnostic& d : outcome.diagnostics) all += (all.empty() ? "" : " ") + std::string(d.kind->code);
  return all;
}

TEST(Uses, EachKindIsVisited) {
  const char* const text = R"(operator blend(a) order 2 = 0.25*a[-1] + 0.5*a + 0.25*a[+1]
model m {
  field u, v
  vector w on faces
  field p
  coefficient c
  param k
  control g
  mask solid
  dt(u) = k*blend(u) + c*g
  dt(v) = 0
  dt(w) = -grad(p)
  0 = div(w) gives p
  v = 1 inside solid
  let q = 2*u
}
scene s : m {
  grid x = 0 .. 1, cells 8, periodic, stretched x + 0.1*sin(2*pi*x)
  solid = x < 0.5
  k = 1
  g = sin(t) every 0.05
  c = sin(2*pi*x)
  initial u = 1
  initial v = 0
  initial w = 0
  exact u = exp(-t)
  time 0 .. 0.1, step 0.05, courant 0.5, speed 1
  after step: u = 2*u
  observe seen = mean(u)
  output q
}
task t : s { unknown k from 2; unknown g from 0; minimise mean(u^2); test miss = mean(u) }
)";
  const Outcome outcome = outcome_of(text, {.name = "t"});
  ASSERT_TRUE(outcome.problem) << outcome.code_and_hint();
  Problem problem = *outcome.problem;
  problem.metric = Metric{"", {coordinate(0)}};
  problem.task->tests.front().fields = {field("u")};
  std::set<UseKind> seen;
  int formulas = 0;
  for_each_formula(problem, [&](const Use& use) { seen.insert(use.kind), ++formulas; });
  for (const UseKind kind : all_kinds())
    EXPECT_TRUE(seen.contains(kind)) << static_cast<int>(kind) << ": no formula of this kind is visited";
  Problem same = problem, other = problem;
  int rewritten = 0;
  rewrite_formulas(same, [](const Use& use) { return use.formula; });
  EXPECT_EQ(print(same), print(problem));
  rewrite_formulas(other, [&](const Use&) { return ++rewritten, Expr(7); });
  EXPECT_EQ(rewritten, formulas);
  for_each_formula(other, [&](const Use& use) { EXPECT_TRUE(is_literal(use.formula, 7)); });
}

TEST(Uses, PartsAreMappedAsTheyAreVisited) {
  const Expr u = field("u"), x = coordinate(0);
  Solve solved{"phi", u, x, {AxisSides{{SideKind::value, u}, {SideKind::value, x}}}};
  const std::vector<Expr> all{negate(u),
                              binary(BinaryOp::add, u, x),
                              call(Fn::max, {u, x}),
                              select(binary(BinaryOp::less, u, x), u, x),
                              derivative(u, 0, 1),
                              advect({u}, x),
                              shift(u, {1}),
                              interpolate(u),
                              sample({"u", {x}}),
                              reduce(Reduce::Kind::mean, u),
                              network_call({"n", {u, x}}),
                              solve(solved)};
  for (const Expr& e : all) {
    int parts = 0, replaced = 0;
    for_each_child(e, [&](const Expr&) { ++parts; });
    EXPECT_EQ(map_children(e, [](const Expr& part) { return part; }), e);
    const Expr other = map_children(e, [&](const Expr&) { return ++replaced, field("v"); });
    EXPECT_EQ(replaced, parts);
    for_each_child(other, [&](const Expr& part) { EXPECT_TRUE(reads(part, "v")); });
  }
}

/// The derivative of what jumps where a periodic axis closes.
TEST(Uses, SeamsAreSeenInEachPlace) {
  const Thing jump{.formula = "dy(beta*y)", .in_model = "  param beta = 1\n"};
  for (const auto& [kind, slot] : slots())
    EXPECT_EQ(codes(outcome_of(text_with_thing(jump, slot), {.name = "t"})), "W0303") << slot;
  EXPECT_EQ(codes(outcome_of(text_with_thing(jump, "none"), {.name = "t"})), "W0301") << "nothing uses beta";
}

/// What is divided by a length of 0 where it is taken.
TEST(Uses, PolesAreSeenInEachPlace) {
  const Thing on_pole{.formula = "inner(grad(f), grad(f))",
                      .in_model = "  vector f on faces\n  dt(f) = 0*f\n",
                      .in_scene =
                          "  coordinates sphere(1)\n  boundary f.x: lat = pole\n  boundary f.y: lat = 0\n"
                          "  boundary u: lat = pole\n  boundary v: lat = pole\n  initial f = (cos(lat), 0)\n",
                      .grid = "  grid lon = 0 .. 2*pi, cells 8, periodic\n  grid lat = -pi/2 .. pi/2, cells 4\n"};
  for (const auto& [kind, slot] : slots()) {
    if (slot == "constraint") continue;  // a solve for its potential reads across no pole
    std::string text = text_with_thing(on_pole, slot);
    text.replace(text.find("solid = x < 0.5"), 15, "solid = lon < 2");
    EXPECT_EQ(codes(outcome_of(text, {.name = "t"})), "E0441") << slot;
  }
}

TEST(Uses, SolvesAreSeenInEachPlace) {
  const Thing solved{.formula = "phi", .in_model = "  solve lap(phi) - phi = u for phi\n"};
  for (const auto& [kind, slot] : slots()) {
    const Outcome outcome = outcome_of(text_with_thing(solved, slot), {.name = "t"});
    ASSERT_TRUE(outcome.problem) << slot << ": " << outcome.code_and_hint();
    const std::vector<const Solve*> solves = solves_of(*outcome.problem);
    EXPECT_EQ(std::ranges::count(solves, "phi", [](const Solve* solve) { return solve->name; }), 1) << slot;
    EXPECT_NE(print(*outcome.problem).find("for phi"), std::string::npos) << slot;
  }
}

/// What a scheme says of solves is told to be idle only where nothing solves. Solutions are kept by steps alone, and
/// are states only where steps find them.
TEST(Uses, SolutionsAreKeptWhereStepsFindThem) {
  const Thing kept{.formula = "phi",
                   .in_model = "  solve lap(phi) - phi = u for phi\n",
                   .scheme = "solve = multigrid; smoother = jacobi; guess = last"};
  for (const auto& [kind, slot] : slots()) {
    const Outcome outcome = outcome_of(text_with_thing(kept, slot), {.name = "t"});
    ASSERT_TRUE(outcome.problem) << slot << ": " << outcome.code_and_hint();
    const bool is_of_step = time_of(kind) == UseTime::step && kind != UseKind::courant_rate;
    EXPECT_EQ(outcome.problem->find_state("phi_last") != nullptr, is_of_step) << slot;
    const bool has_others = kind == UseKind::constraint;  // its own potential is kept too
    EXPECT_EQ(codes(outcome), is_of_step || has_others ? "" : "W0506") << slot;
    for (const Solve* solve : solves_of(*outcome.problem)) {
      const std::vector<std::string> kept_last =
          is_of_step ? std::vector<std::string>{"phi_last"} : std::vector<std::string>{};
      if (solve->name == "phi") EXPECT_EQ(solve->guesses, kept_last) << slot;
    }
  }
}

TEST(Uses, WhatIsReadInAPlaceIsKept) {
  const Thing coefficient{.formula = "c", .in_model = "  coefficient c\n", .in_scene = "  c = sin(2*pi*x)\n"};
  const Thing network{.formula = "n(u)", .before = "network n(a) { initial xavier, seed 1; dense 1 }\n"};
  const Thing given{.formula = "twice(u)",
                    .before = "operator twice(a) order 0 = 2*a\n  adjoint a_bar = 2*twice_bar\n"};
  for (const auto& [kind, slot] : slots()) {
    const Outcome read = outcome_of(text_with_thing(coefficient, slot), {.name = "t"});
    ASSERT_TRUE(read.problem) << slot << ": " << read.code_and_hint();
    EXPECT_NE(read.problem->find_coefficient("c"), nullptr) << slot;
    EXPECT_TRUE(read.problem->remarks.dropped.empty()) << slot;
    const Outcome called = outcome_of(text_with_thing(network, slot), {.name = "t"});
    if (called.problem) EXPECT_NE(called.problem->find_network("n"), nullptr) << slot;
    const Outcome applied = outcome_of(text_with_thing(given, slot), {.name = "t"});
    if (applied.problem) EXPECT_NE(print(*applied.problem).find("operator twice"), std::string::npos) << slot;
    EXPECT_TRUE(called.problem && applied.problem) << slot << ": " << called.code_and_hint() << applied.code_and_hint();
  }
}

/// Steps that differ have no steady state; what is made of that state may hold the time.
TEST(Uses, TimeIsSeenInStepsThatEndSteady) {
  const Thing in_time{.formula = "sin(t)"};
  for (const auto& [kind, slot] : slots()) {
    std::string text = text_with_thing(in_time, slot);
    text.replace(text.find("unknown initial u"), 17, "unknown rest");
    text.replace(text.find("field u, v"), 10, "param rest = 1; field u, v");
    text.replace(text.find("dt(v) = 0"), 9, "dt(v) = rest - v");
    text.replace(text.find("step 0.05"), 9, "step 0.05, until steady 1e-3");
    const std::string told = codes(outcome_of(text, {.name = "t"}));
    EXPECT_EQ(told, time_of(kind) == UseTime::step ? "E0311" : "") << slot;
  }
}

}  // namespace
}  // namespace dpde::model
