// SPDX-License-Identifier: Apache-2.0
// Random programs through the interpreter, every pass, the JIT and emitted C++, with their tangents and adjoints.
// DPDE_RANDOM_PROGRAMS: how many (5, at night 25); DPDE_RANDOM_SEED: the first of their seeds (1).
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <map>
#include <thread>

#include "random/check_program.h"
#include "random/isolated.h"
#include "random/shrink.h"
#include "stencil/build.h"
#include "support/derivative_check.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

constexpr int programs_in_a_file = 20;
constexpr double longest = 600, longest_trial = 20;  // seconds of a check, and of one while a program is made smaller

/// A small program with the same failure.
std::string smallest(const RandomProgram& program, const Verdict& verdict, const Checks& checks) {
  const auto again = [&](const RandomProgram& p) {
    if (verdict.check != "cpp") return check_apart(p, checks, longest_trial);
    return check_in_cpp_apart({p}, longest_trial)[0];
  };
  const auto fails = [&](const RandomProgram& p) {
    const Verdict other = again(p);
    return other.kind == Verdict::Kind::failed && other.check == verdict.check;
  };
  // of a smaller kernel another adjoint would be the right one
  const int most = verdict.check == "given adjoint" ? 0 : verdict.check == "cpp" ? 100 : 3000;
  const RandomProgram small = shrink(program, fails, most);
  return "the smallest program that fails so:\n" + describe(small) + again(small).detail;
}

struct Count {
  int passed = 0, refused = 0, wrong_adjoints = 0, kinks = 0, failed = 0, divided = 0;
  double dot_product = 0, finite_difference = 0, back_end = 0;

  void add(const Verdict& v) {
    passed += v.kind == Verdict::Kind::passed;
    const bool is_refused = v.kind == Verdict::Kind::refused, is_wrong_adjoint = is_refused && v.detail == "E0606";
    refused += is_refused && !is_wrong_adjoint;
    wrong_adjoints += is_wrong_adjoint;
    kinks += v.kind == Verdict::Kind::kink;
    failed += v.kind == Verdict::Kind::failed;
    divided += v.divided;
    dot_product = std::max(dot_product, v.dot_product);
    if (v.kind == Verdict::Kind::passed) finite_difference = std::max(finite_difference, v.finite_difference);
    back_end = std::max(back_end, v.back_end);
  }
};

TEST(RandomPrograms, AgreeEverywhere) {
  const std::uint64_t first = setting("DPDE_RANDOM_SEED", 1),
                      count = setting("DPDE_RANDOM_PROGRAMS", is_thorough() ? 25 : 5);
  Count total;
  std::vector<RandomProgram> for_cpp;
  const auto report = [&](const RandomProgram& program, const Verdict& verdict, const Checks& checks) {
    ADD_FAILURE() << "seed " << program.seed << ": " << verdict.check << "\n"
                  << verdict.detail << "\n"
                  << smallest(program, verdict, checks);
  };
  for (std::uint64_t seed = first; seed < first + count && total.failed < 5; ++seed) {
    const RandomProgram program = random_program(seed);
    const Checks checks{true, seed % 4 == 0, seed % 16 == 0};
    const Verdict verdict = check_apart(program, checks, longest);
    total.add(verdict);
    if (verdict.kind == Verdict::Kind::failed) report(program, verdict, checks);
    if (seed % 10 == 0 && verdict.kind != Verdict::Kind::failed && verdict.detail != "overflow")
      for_cpp.push_back(program);
    const bool is_last = seed + 1 == first + count;
    if (for_cpp.empty() || (for_cpp.size() < programs_in_a_file && !is_last)) continue;
    const std::vector<Verdict> verdicts = check_in_cpp_apart(for_cpp, longest);
    for (std::size_t i = 0; i < verdicts.size(); ++i) {
      total.back_end = std::max(total.back_end, verdicts[i].back_end);
      if (verdicts[i].kind == Verdict::Kind::failed) report(for_cpp[i], verdicts[i], checks);
    }
    for_cpp.clear();
  }
  std::cout << total.passed << " passed, " << total.refused << " refused, " << total.wrong_adjoints
            << " given a wrong adjoint, " << total.kinks << " at a kink or too steep, " << total.failed
            << " failed; dot products to " << total.dot_product << ", differences to " << total.finite_difference
            << ", back ends to " << total.back_end << "; " << total.divided << " times among ranks\n";
  EXPECT_GE(total.divided, total.passed);  // few grids are too small to be divided
  const int all = total.passed + total.refused + total.wrong_adjoints + total.kinks + total.failed;
  if (all >= 200) {
    EXPECT_LE(total.refused, all / 8);  // what has no derivative is refused, but not everything
    EXPECT_GE(total.wrong_adjoints, all / 400);
  }
  EXPECT_LE(total.kinks, all / 100);
}

/// Failures found once by random programs, which they would find again only by chance.
TEST(RandomPrograms, FoundBefore) {
  const auto check = [](const std::string& text) {
    return check_program({1, parse_module(text), {{"u", "v"}, {"nu"}}, {1, {3, 1, 1}}}, {true, true, false});
  };
  const Verdict early_fill = check(  // the fill of the next state came before the computed halo was read
      "kernel k(u: field, out w: field) { w = u^2 }\nkernel add(v: field, inout w: field) { w += v }\n"
      "kernel l(w: field halo 1, out r: field) { r = w[+1]*w }\n"
      "program p { fill u x = zero_gradient; run k grow 1; run add; run l; swap u, w; keep r }");
  EXPECT_EQ(early_fill.kind, Verdict::Kind::passed) << early_fill.check << early_fill.detail;
  const Verdict late_fill = check(  // recomputed, the halo is not what it was when it was read
      "kernel k(v: field, out w: field) { w = v^2 }\nkernel l(u: field, w: field, sum s: param) { s += u*w }\n"
      "program p { fill u x = zero_gradient; fill v x = 0; run k grow 1; run l grow 1; fill w x = 0.2; keep w }");
  EXPECT_EQ(late_fill.detail, "E0603") << late_fill.check;
  const Verdict fold = check(  // the adjoint's seeds have a halo by their fill, and zeros behind their fold
      "kernel k(out w: field, nu: param) { w = nu }\n"
      "program p { run k grow 1; fill w x = zero_gradient; fold w grow 1 x = zero_gradient; keep w }");
  EXPECT_EQ(fold.kind, Verdict::Kind::passed) << fold.check << fold.detail;
  const Verdict repeats = check(  // the adjoint's second repeat, read back, filled once more what its passes change
      "kernel k(out w: field) { w = 1 }\nkernel s(u: field, inout w: field) { interp(w, 1) += u }\n"
      "kernel l(w: field halo 1, out r: field) { r = w + w[+1] }\nkernel n(r: field, out v: field) { v = sin(r) }\n"
      "program p { repeat 3 { run k grow 2; fill w x = 1; run s; run l; run n; swap u, v } to u_last; keep u_last }");
  EXPECT_EQ(repeats.kind, Verdict::Kind::passed) << repeats.check << repeats.detail;
}

TEST(RandomPrograms, AreTheSameEverywhere) {
  EXPECT_EQ(describe(random_program(7)), describe(random_program(7)));
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    for (const char c : describe(random_program(seed))) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  }
  EXPECT_EQ(hash, 14730881997813593137u) << "the generator has changed: seeds of old failures mean other programs now";
}

TEST(RandomPrograms, CountPassesInBothDirections) {
  int up = 0, down = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    const RandomProgram random = random_program(seed);
    const auto* repeat = std::get_if<stencil::Repeat>(&random.module.programs.front().body.front());
    if (repeat == nullptr || repeat->counter.name.empty() || describe(random).find("*k") == std::string::npos) continue;
    ++(repeat->counter.is_backwards ? down : up);
  }
  EXPECT_GE(up, 3);
  EXPECT_GE(down, 3);
}

/// With a slow check, as of a large program, the search for a smaller program still ends in time.
TEST(Shrink, EndsInTime) {
  const auto start = std::chrono::steady_clock::now();
  int asked = 0;
  shrink(
      random_program(7),
      [&](const RandomProgram&) {
        ++asked;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        return false;
      },
      3000, 0.2);
  EXPECT_GT(asked, 0);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}

TEST(Isolated, WhatHangsOrCrashesIsAnAnswer) {
  EXPECT_EQ(isolated([] { return std::string("done"); }, 60).text, "done");
  EXPECT_EQ(isolated([] { return std::this_thread::sleep_for(std::chrono::hours(1)), std::string("late"); }, 0.1).kind,
            Answer::Kind::late);
  const Answer crash = isolated([]() -> std::string { std::abort(); }, 60);
  EXPECT_EQ(crash.kind, Answer::Kind::crashed);
  EXPECT_EQ(crash.text, "signal 6");
}

/// With a made-up fault, "a sine of something read from the left", that is what is left.
TEST(Shrink, LeavesTheFaultAlone) {
  const auto has_fault = [](const RandomProgram& p) {
    const auto is_from_left = [](const stencil::Expr& e) {
      const stencil::Access* a = as<stencil::Access>(e);
      return a && a->offset[0] < 0;
    };
    return std::ranges::any_of(p.module.kernels, [&](const stencil::Kernel& kernel) {
      return any_part(kernel, [&](const stencil::Expr& e) {
        const stencil::Call* call = as<stencil::Call>(e);
        return call && call->fn == Fn::sin && any_part(e, is_from_left);
      });
    });
  };
  int shrunk = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const RandomProgram program = random_program(seed);
    if (!has_fault(program)) continue;
    const RandomProgram small = shrink(program, has_fault);
    ++shrunk;
    EXPECT_TRUE(has_fault(small));
    EXPECT_EQ(small.grid.cells, (std::array<int, 3>{1, 1, 1}));
    EXPECT_LE(small.module.kernels.size(), 4u) << describe(small);
    EXPECT_LE(describe(small).size(), 450u) << describe(small);
  }
  EXPECT_GE(shrunk, 5);
}

}  // namespace
}  // namespace dpde::testing
