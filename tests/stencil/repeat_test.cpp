// SPDX-License-Identifier: Apache-2.0
// `repeat` in programs: how it is read and printed, that it means what a person would have written pass by pass, and
// what is said about repeats that mean nothing.
#include <cmath>

#include "stencil/analyse/verify_stencil.h"
#include "stencil_text.h"

namespace dpde::stencil {
namespace {

const std::string jacobi =
    "kernel jacobi(u: field halo 1, b: field, out v: field, c: param) { v = (c*(u[-1] + u[+1]) + b)/(1 + 2*c) }\n";

/// Each field is written once: behind the repeat u is a field of its own.
TEST(Repeat, ReadsBackAsItIsPrinted) {
  const Module module =
      module_of(jacobi + "program p {\n  repeat 3 {\n    fill u periodic\n    run jacobi\n    swap u, v\n  }\n}\n");
  const std::string text = R"(kernel jacobi(u: field halo 1, b: field, out v: field, c: param) {
  v = (c*(u[-1] + u[+1]) + b)/(1 + 2*c)
}

program p {
  repeat 3 {
    fill u periodic
    run jacobi
    swap u, v
  } to u_2
  swap u, u_2
}
)";
  EXPECT_EQ(print(module), text);
  EXPECT_EQ(print(module_of(text)), text);
}

/// k is a parameter of what the block runs and fills, 0, 1, 2 or 2, 1, 0.
TEST(Repeat, Counts) {
  const auto text = [](const std::string& passes) {
    return "kernel count(u: field, out v: field, k: param) {\n  v = 10*u + k\n}\n\nprogram p {\n  axes x periodic\n  "
           "repeat k in " +
           passes + " {\n    run count\n    swap u, v\n  } to u_2\n  swap u, u_2\n}\n";
  };
  for (const auto& [passes, expected] : {std::pair{"0 .. 3", 7012.0}, {"3 .. 0", 7210.0}}) {
    const Module module = module_of(text(passes));
    EXPECT_EQ(print(module), text(passes));
    EXPECT_EQ(interface_of(module, module.programs[0]).params, std::vector<std::string>{});
    State state({1, {2, 1, 1}}, 1);
    state.set("u", {7, 7});
    interpret(module, module.programs[0], state, {});
    EXPECT_EQ(state.get("u"), (std::vector<double>{expected, expected}));
  }
}

TEST(Repeat, CountsByANameThatIsNothingElse) {
  Module module = module_of(jacobi + "program p { repeat k in 0 .. 3 { fill u periodic; run jacobi; swap u, v } }\n");
  EXPECT_EQ(verify(module), std::vector<std::string>{});
  for (const std::string name : {"u", "b", "u_2", "t", "x", "hx"}) {
    std::get<Repeat>(module.programs[0].body[0]).counter.name = name;
    EXPECT_EQ(verify(module).front(),
              "program p counts the passes of a repeat by " + name + ", which is something else");
  }
}

/// Behind the repeat kernels that read u are copies that read u_2.
TEST(Repeat, LeavesANameThatMeansItsResult) {
  const std::string square = "kernel square(u: field, out w: field) { w = u^2 }\n";
  const Module module = module_of(jacobi + square +
                                  "program p { repeat 2 { fill u periodic; run jacobi; swap u, v }; run square; "
                                  "swap u, w }");
  EXPECT_NE(print(module).find("  } to u_2\n  run square_2\n  swap u, w\n"), std::string::npos) << print(module);
}

const std::string stacks = R"(kernel double(u: field, out v: field) {
  v = 2*u
}

kernel join(w: field, u: field, out r: field) {
  r = 10*w + u
}

program p {
  axes x periodic
  repeat 3 {
    save u in each
    run double
    swap u, v
  } to last
  repeat 3 {
    load u from each
    run join
    swap w, r
  } to all
  keep all, last
}
)";

TEST(Repeat, LoadsWhatAnotherHasSavedLastOneFirst) {
  const Module module = module_of(stacks);
  EXPECT_EQ(print(module), stacks);
  EXPECT_EQ(verify(module), std::vector<std::string>{});
  State state(Grid{1, {2, 1, 1}}, 1);
  state.set("u", {1, 2});
  state.set("w", {0, 0});
  interpret(module, module.programs[0], state, {});
  EXPECT_EQ(state.get("all"), (std::vector<double>{421, 842}));
  EXPECT_EQ(state.get("last"), (std::vector<double>{8, 16}));
  EXPECT_EQ(state.get("u"), (std::vector<double>{1, 2}));
}

TEST(Repeat, KeepsItsRules) {
  const auto problems_with = [](const std::string& from, const std::string& to) {
    Module module = module_of(stacks);
    Repeat& first = std::get<Repeat>(module.programs[0].body[0]);
    Repeat& second = std::get<Repeat>(module.programs[0].body[1]);
    for (LoopCarried* carry : {&first.carries[0], &second.carries[0]}) {
      for (std::string* name : {&carry->state, &carry->next, &carry->result}) *name = *name == from ? to : *name;
    }
    for (TapeEntry* stacked : {&first.saves[0], &second.loads[0]}) {
      if (stacked->stack == from) stacked->stack = to;
      break;
    }
    return verify(module);
  };
  EXPECT_EQ(problems_with("v", "u").front(), "program p has u or u in two swaps of a repeat");
  EXPECT_EQ(problems_with("last", "all"),
            (std::vector<std::string>{"program p writes all twice", "program p keeps last, which it does not write"}));
  EXPECT_EQ(problems_with("each", "other"),
            std::vector<std::string>{"program p loads from each, which no repeat of 3 passes has saved"});
  EXPECT_EQ(problems_with("last", "v").back(), "program p uses v both in a block, which writes it, and outside");
  Module module = module_of(stacks);
  std::get<Repeat>(module.programs[0].body[0]).count = 2;
  EXPECT_EQ(verify(module),
            std::vector<std::string>{"program p loads from each, which no repeat of 3 passes has saved"});
  module.programs[0].keeps.push_back("v");
  EXPECT_EQ(verify(module).back(), "program p keeps v, which it does not write");
}

/// What a pass has for itself another repeat may have too.
TEST(Repeat, FieldsOfOnePassAreNothingToOtherRepeats) {
  const std::string twice = jacobi +
                            "program p { repeat 2 { fill u periodic; run jacobi; swap u, v } to w\n"
                            "repeat 3 { fill u periodic; run jacobi; swap u, v } to q\nkeep w, q }";
  const Module module = module_of(twice);
  EXPECT_EQ(module.kernels.size(), 1u) << print(module);
  EXPECT_EQ(verify(module), std::vector<std::string>{});
  EXPECT_EQ(print(module_of(print(module))), print(module));
}

/// A fill before the repeat holds in each pass for what the passes leave alone.
TEST(Repeat, FillsAgainWhatStaysTheSame) {
  const std::string flow = "kernel flow(u: field, c: field halo 1, out v: field) { v = u + c[+1] - c[-1] }\n";
  const Module module = module_of(flow + "program p { fill c x = 0; repeat 2 { run flow; swap u, v } }");
  EXPECT_NE(print(module).find("repeat 2 {\n    fill c x = 0\n    run flow\n"), std::string::npos) << print(module);
}

/// The interpreter's results of two texts, for random states on small grids.
void expect_same_meaning(const std::string& repeated, const std::string& by_hand,
                         const std::vector<std::string>& fields) {
  const Module a = module_of(repeated), b = module_of(by_hand);
  for (int n = 1; n <= 5; ++n) {
    const Grid grid{1, {n, 1, 1}};
    State first(grid, 2);
    Random random(static_cast<unsigned>(n));
    for (const std::string& field : fields) random.fill_interior(first, field);
    State second = first;
    const Params params{{"c", 0.3}, {"dt", 0.1}, {"hx", 0.5}};
    for (int step = 0; step < 2; ++step) {
      const auto sums = interpret(a, a.programs[0], first, params);
      EXPECT_EQ(sums, interpret(b, b.programs[0], second, params));
    }
    for (const std::string& field : fields) EXPECT_EQ(first.get(field), second.get(field)) << field << " on " << n;
  }
}

TEST(Repeat, MeansWhatAPersonWouldHaveWritten) {
  const std::string sweeps =
      "kernel one(u: field, w: field halo 1, out v: field, sum e: param, c: param) { v = u + c*(w[-1] + w[+1]); e += "
      "w^2 }\n"
      "kernel start(u: field, out w: field) { w = 2*u }\n";
  expect_same_meaning(sweeps + "program p { run start; repeat 2 { fill w x = c; run one; swap w, v }; swap u, w }",
                      sweeps +
                          "kernel two(u: field, v: field halo 1, out r: field, sum e: param, c: param) { r = u + "
                          "c*(v[-1] + v[+1]); e += v^2 }\n"
                          "program p { run start; fill w x = c; run one; fill v x = c; run two; swap u, r }",
                      {"u"});
}

/// The next but one value from the last two: both are swapped at once.
TEST(Repeat, SwapsOfOneRepeatHappenAtOnce) {
  const std::string leap =
      "kernel leap(old: field, u: field halo 1, out v: field, c: param) { v = 2*u - old + c*(u[-1] - 2*u + u[+1]) }\n";
  expect_same_meaning(leap + "program p { repeat 3 { fill u periodic; run leap; swap old, u; swap u, v } }",
                      leap +
                          "kernel leap_2(u: field, v: field halo 1, out v2: field, c: param) { v2 = 2*v - u + c*(v[-1] "
                          "- 2*v + v[+1]) }\n"
                          "kernel leap_3(v: field, v2: field halo 1, out v3: field, c: param) { v3 = 2*v2 - v + "
                          "c*(v2[-1] - 2*v2 + v2[+1]) }\n"
                          "program p { fill u periodic; run leap; fill v periodic; run leap_2; fill v2 periodic; run "
                          "leap_3; swap old, v2; swap u, v3 }",
                      {"old", "u"});
}

TEST(Repeat, FieldsOfAPassAreItsOwnAndSumsGoOn) {
  const std::string kernels =
      "kernel rate(u: field halo 1, out r: field) { r = u[-1] - 2*u + u[+1] }\n"
      "kernel step(u: field, r: field, out v: field, sum e: param, dt: param) { v = u + dt*r; e += r }\n";
  const Module module =
      module_of(kernels + "program p { repeat 2 { repeat 2 { fill u periodic; run rate; run step; swap u, v } } }");
  EXPECT_EQ(
      print(module.programs[0]),
      "program p {\n  repeat 2 {\n    repeat 2 {\n      fill u periodic\n      run rate\n      run step\n      swap u, "
      "v\n    } to u_2\n    swap u, u_2\n  } to u_3\n  swap u, u_3\n}\n");
  State state(Grid{1, {3, 1, 1}}, 1);
  state.set("u", {1, 2, 4});
  EXPECT_NEAR(interpret(module, module.programs[0], state, {{"dt", 0.1}}).at("e"), 0, 1e-14);
  double total = 0;
  for (const double value : state.get("u")) total += value;
  EXPECT_NEAR(total, 7, 1e-14);
}

TEST(Repeat, AccumulatesOntoWhatWasWrittenBefore) {
  const std::string kernels =
      "kernel zero(out a: field) on 1 axis { a = 0 }\nkernel add(u: field, inout a: field) { a += u^2 }\n"
      "kernel halve(u: field, out v: field) { v = u/2 }\n";
  const Module module = module_of(
      kernels + "program p { axes x periodic; run zero; repeat 3 { run add; run halve; swap u, v }; keep a }");
  State state(Grid{1, {1, 1, 1}}, 1);
  state.set("u", {8});
  interpret(module, module.programs[0], state, {});
  EXPECT_EQ(state.get("a"), std::vector<double>{64 + 16 + 4});
  EXPECT_EQ(state.get("u"), std::vector<double>{1});
}

/// Behind swap u, w both names mean what w was: it is copied where a pass does not make it.
TEST(Repeat, NamesThatBecomeOneFieldAreCopied) {
  const std::string kernels =
      "kernel a(u: field, out w: field) { w = u }\nkernel add(w: field, inout u: field) { u += 2*w }\n";
  const Module module = module_of(kernels + "program p { axes x periodic; run a; repeat 3 { run add; swap u, w } }");
  State state(Grid{1, {1, 1, 1}}, 1);
  state.set("u", {5});
  interpret(module, module.programs[0], state, {});
  EXPECT_EQ(state.get("u"), std::vector<double>{5});
}

TEST(Repeat, OnlyInputsBecomeTheNextState) {
  const std::string begin =
      "kernel begin(u: field, out w: field) { w = u }\nkernel next(u: field, w: field, out v: field) { v = u*w }\n";
  const Module module =
      module_of(begin + "program p { axes x periodic; run begin; repeat 2 { run next; swap w, v }; swap u, w }");
  EXPECT_EQ(
      print(module.programs[0]),
      "program p {\n  axes x periodic\n  run begin\n  repeat 2 {\n    run next\n    swap w, v\n  } to w_2\n  swap u, "
      "w_2\n}\n");
}

TEST(Repeat, NamesThatAreTakenAreLeftAlone) {
  const Module module = module_of(
      "kernel k(u: field, v_2: field, out v: field) { let v_3 = u*v_2; v = v_3 }\n"
      "kernel k_2(u: field, out w: field) { w = u }\n"
      "program p { axes x periodic; repeat 2 { run k; swap u, v }; run k_2; keep w }");
  EXPECT_EQ(
      print(module.programs[0]),
      "program p {\n  axes x periodic\n  repeat 2 {\n    run k\n    swap u, v\n  } to u_2\n  run k_2_2\n  swap u, "
      "u_2\n  keep w\n}\n");
  EXPECT_EQ(verify(module), std::vector<std::string>{});
}

TEST(Repeat, GivenAdjointsGoAlong) {
  const Module module = module_of(
      "kernel half(u: field halo 1, out v: field, a: param) { v = a*u\n adjoint u_bar = a*v_bar\n adjoint a_bar += "
      "u*v_bar }\n"
      "program p { axes x periodic; repeat 2 { run half; swap u, v }; run half; swap u, v }");
  const std::string text = print(module.kernels.at(1));
  EXPECT_NE(text.find("kernel half_2(u_2: field, out v_2: field, a: param)"), std::string::npos) << text;
  EXPECT_NE(text.find("adjoint u_2_bar = "), std::string::npos) << text;
  EXPECT_NE(text.find("adjoint a_bar += "), std::string::npos) << text;
  EXPECT_NE(text.find("v_2_bar"), std::string::npos) << text;
}

/// k sweeps of Jacobi's iteration for (1 + 2c) v - c (v[-1] + v[+1]) = b, begun with b, on a sine of wave number m: the
/// iteration matrix takes the mode q_0 = 1 to q_(i+1) = (1 + 2c cos(2 pi m/n) q_i)/(1 + 2c).
TEST(Repeat, OfJacobiSweepsIsThePowerOfTheIterationMatrix) {
  const int n = 16, m = 3, sweeps = 7;
  const double c = 0.8, pi = std::acos(-1.0), mu = 2 * c * std::cos(2 * pi * m / n) / (1 + 2 * c);
  const Module module = module_of(
      "kernel begin(u: field, out w: field) { w = u }\n"
      "kernel jacobi(u: field, w: field halo 1, out v: field, c: param) { v = (u + c*(w[-1] + w[+1]))/(1 + 2*c) }\n"
      "program implicit { run begin; repeat 7 { fill w periodic; run jacobi; swap w, v }; swap u, w }\n");
  State state(Grid{1, {n, 1, 1}}, 1);
  std::vector<double> mode;
  for (int i = 0; i < n; ++i) mode.push_back(std::sin(2 * pi * m * i / n));
  state.set("u", mode);
  interpret(module, module.programs[0], state, {{"c", c}});
  // (I - M)^-1 (I - M^k) b/(1 + 2c) + M^k b, as a number for this mode
  const double factor = (1 - std::pow(mu, sweeps)) / (1 - mu) / (1 + 2 * c) + std::pow(mu, sweeps);
  for (int i = 0; i < n; ++i)
    EXPECT_NEAR(state.get("u")[static_cast<std::size_t>(i)], factor * mode[static_cast<std::size_t>(i)], 1e-14);
}

}  // namespace
}  // namespace dpde::stencil
