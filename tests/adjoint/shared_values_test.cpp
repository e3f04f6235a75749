// SPDX-License-Identifier: Apache-2.0
// Values that many terms of a gather need are stored once: where that pays, and with the results of the gather written
// out by hand.
#include "adjoint/shared_values.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <map>
#include <new>
#include <utility>

#include "adjoint/adjoint.h"
#include "stencil/text/print_stencil.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"
#include "support/split_mix.h"

namespace {

std::atomic<std::size_t> allocations = 0;

}  // namespace

// All of this program: what takes memory is counted. Inlined by halves they would look like a mismatch to the compiler.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  void* const memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

namespace dpde {
namespace {

/// Weights of a wide stencil, at the offsets -3 to 3 along each axis.
constexpr double weights[] = {0.7, -2.1, 3.3, -4.9, 2.2, 1.3, -0.4};

std::string at(int axis, int k) { return axis == 0 ? fmt::format("[{:+}, 0]", k) : fmt::format("[0, {:+}]", k); }

/// w = u + c*a*b*(sum of weights*u): its adjoint needs c*a*b*w_bar at 13 points.
std::string step(const std::string& boundary) {
  std::string sum;
  for (int axis = 0; axis < 2; ++axis) {
    for (int k = -3; k <= 3; ++k) sum += fmt::format(" + {}*u{}", weights[k + 3], at(axis, k));
  }
  return "kernel k(u: field halo 3, a: field, b: field, out w: field, c: param) { w = u + c*a*b*(0" + sum +
         ") }\n"
         "program p { fill u " +
         boundary + "; run k; swap u, w }\n";
}

/// The same adjoint in one kernel, as it is on paper: every term made where it is needed, and 0 where no cell lies.
std::string by_hand(const std::string& fills, bool is_bounded) {
  std::string sum;
  for (int axis = 0; axis < 2; ++axis) {
    for (int k = -3; k <= 3; ++k) {
      const std::string from = at(axis, -k);
      sum += fmt::format(" + if(inside{0}, c*a{0}*b{0}*w_bar{0}*{1}, 0)", from, weights[k + 3]);
    }
  }
  const std::string boundary = is_bounded ? "fold u_bar grow 3 " + fills + "; " : "";
  const std::string seeds = is_bounded ? "" : "fill w_bar " + fills + "; fill a " + fills + "; fill b " + fills + "; ";
  return "kernel g(w_bar: field halo 3, a: field halo 3, b: field halo 3, out u_bar: field, c: param) { u_bar = "
         "if(inside[0, 0], w_bar, 0)" +
         sum +
         " }\n"
         "program p_adjoint { " +
         seeds + "run g" + (is_bounded ? " grow 3; " : "; ") + boundary + "swap w_bar, u_bar }\n";
}

std::vector<double> run(const stencil::Module& module, const std::string& program, const stencil::Grid& grid) {
  stencil::State state(grid, 6);
  testing::SplitMix random(7);
  for (const char* field : {"a", "b", "w_bar"})
    state.set(field, random.uniform(static_cast<size_t>(grid.cells[0]) * grid.cells[1], -1, 1));
  stencil::interpret(module, *module.find_program(program), state, {{"c", 0.3}, {"hx", 0.3}, {"hy", 0.4}});
  return state.get("w_bar");  // swapped: holds u_bar
}

void expect_as_by_hand(const std::string& boundary, const std::string& hand) {
  const stencil::Module primal = testing::parse_module(step(boundary)), expected = testing::parse_module(hand);
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(primal, "p", {{"u"}, {}}, sink);
  ASSERT_FALSE(sink.has_errors());
  ASSERT_NE(derived.module.find_kernel("k_adjoint_shared"), nullptr) << stencil::print(derived.module);
  for (const stencil::Grid& grid : testing::small_grids(2)) {
    const std::vector<double> found = run(derived.module, derived.program, grid),
                              known = run(expected, "p_adjoint", grid);
    ASSERT_EQ(found.size(), known.size());
    for (size_t i = 0; i < found.size(); ++i)
      EXPECT_NEAR(found[i], known[i], 1e-14) << grid.cells[0] << " x " << grid.cells[1];
  }
}

TEST(SharedValues, AroundPeriodicAxesAreThoseOfOneGather) { expect_as_by_hand("periodic", by_hand("periodic", false)); }

TEST(SharedValues, BetweenWallsAreThoseOfOneGather) {
  expect_as_by_hand("x = zero_gradient, y.low = 0.4, y.high = gradient(0.1)",
                    by_hand("x = zero_gradient, y.low = 0, y.high = gradient(0)", true));
}

bool is_split(const std::string& text) {
  const stencil::Module module = testing::parse_module(text);
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
  EXPECT_FALSE(sink.has_errors());
  const bool has_first = derived.module.find_kernel("k_adjoint_shared") != nullptr;
  for (const stencil::Kernel& kernel : derived.module.kernels)
    EXPECT_EQ(has_first, stencil::print(kernel).find("shared_bar") != std::string::npos) << kernel.name;
  return has_first;
}

/// The cases that all the other tests of derivatives and back ends go through: kernels that store, and fields they
/// store.
TEST(SharedValues, AreInTheProgramsOfOtherTests) {
  const std::map<std::string, std::pair<int, int>> expected = {
      {"shared values periodic", {1, 1}},           {"shared values bounded", {1, 1}},
      {"shared values in two kernels", {2, 2}},     {"shared values of two fields", {1, 2}},
      {"shared values, one axis periodic", {1, 1}}, {"shared values beyond walls", {1, 1}}};
  size_t seen = 0;
  for (const testing::ProgramCase& c : testing::program_cases()) {
    DiagnosticSink sink;
    const adjoint::Derivative derived = adjoint::adjoint(testing::parse_module(c.text), "p", c.wrt, sink);
    std::pair<int, int> found{};
    for (const stencil::Kernel& kernel : derived.module.kernels) {
      if (!kernel.name.ends_with("_adjoint_shared")) continue;
      ++found.first;
      for (const stencil::Store& store : kernel.stores) found.second += store.field.starts_with("shared_bar") ? 1 : 0;
    }
    const auto known = expected.find(c.name);
    seen += known == expected.end() ? 0 : 1;
    EXPECT_EQ(found, known == expected.end() ? std::pair(0, 0) : known->second)
        << c.name << stencil::print(derived.module);
  }
  EXPECT_EQ(seen, expected.size());
}

/// What costs little is made again: one more field through memory costs more than five points of two fields.
TEST(SharedValues, AreMadeAgainWhereTheyAreCheap) {
  const std::string five = "(u[-1, 0] + u[+1, 0] + u[0, -1] + u[0, +1] - 4*u)";
  const std::string program = "program p { fill u periodic; run k; swap u, w }\n";
  EXPECT_FALSE(is_split("kernel k(u: field halo 1, out w: field, c: param) { w = u + c*" + five + " }\n" + program));
  EXPECT_FALSE(is_split("kernel k(u: field halo 1, a: field, out w: field) { w = u + a*" + five + " }\n" + program));
  EXPECT_TRUE(
      is_split("kernel k(u: field halo 1, a: field, b: field, d: field, e: field, f: field, out w: field) { w = u + "
               "a*b*d*e*f*exp(a*b)*sqrt(d*e)*sin(f)*" +
               five + " }\n" + program));
}

/// A field that one axis' fill would spoil beyond the walls of the other: made again, and so refused as it always was.
TEST(SharedValues, BesidePeriodicAxesAreNotStoredBeyondWalls) {
  const std::string text = step("x periodic, y = 0.2");
  const std::string grown =
      "kernel use(w: field halo 1, out r: field) { r = w[0, +1] }\n"
      "program q { fill u x periodic, y = 0.2; fill a x periodic, y = 0; fill b x periodic, y = 0; run k grow 1; run "
      "use; keep r }\n";
  const stencil::Module module = testing::parse_module(text + grown);
  DiagnosticSink sink;
  const adjoint::Derivative inside = adjoint::adjoint(module, "p", {{"u"}, {}}, sink);
  EXPECT_FALSE(sink.has_errors());
  EXPECT_NE(inside.module.find_kernel("k_adjoint_shared"), nullptr);
  adjoint::adjoint(module, "q", {{"u"}, {}}, sink);
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(sink.all()[0].kind->code, "E0601");
}

/// `count` states, each of which has a value that costs much and stands in 13 terms.
std::size_t allocations_of(int count) {
  std::string arguments, stores, fills, swaps;
  adjoint::Activity wrt;
  for (int n = 0; n < count; ++n) {
    const auto name = [&](const std::string& stem) { return fmt::format("{}{}", stem, n); };
    std::string costly = name("a"), sum = "0";
    for (int k = 0; k < 24; ++k) costly = fmt::format("sin({} + {})", costly, name("b"));
    for (int axis = 0; axis < 2; ++axis) {
      for (int k = -3; k <= 3; ++k) sum += fmt::format(" + {}*{}{}", weights[k + 3], name("u"), at(axis, k));
    }
    arguments += fmt::format("{}: field halo 3, {}: field, {}: field, out {}: field, ", name("u"), name("a"), name("b"),
                             name("w"));
    stores += fmt::format("  {0} = {1} + c*{2}*({3})\n", name("w"), name("u"), costly, sum);
    fills += fmt::format("fill {} periodic; ", name("u"));
    swaps += fmt::format("; swap {}, {}", name("u"), name("w"));
    wrt.fields.insert(name("u"));
  }
  const stencil::Module module = testing::parse_module("kernel k(" + arguments + "c: param) {\n" + stores +
                                                       "}\nprogram p { " + fills + "run k" + swaps + " }\n");
  DiagnosticSink sink;
  const std::size_t before = allocations;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", wrt, sink);
  const std::size_t made = allocations - before;
  std::size_t stored = 0;
  for (const stencil::Kernel& kernel : derived.module.kernels) {
    for (const stencil::Store& store : kernel.stores) stored += store.field.starts_with("shared_bar") ? 1 : 0;
  }
  EXPECT_EQ(stored, static_cast<std::size_t>(count));
  return made;
}

/// What is stored was looked for anew, with all terms numbered, for each value: four times as much for twice the text.
TEST(SharedValues, AreFoundInProportionToTheText) {
  const std::size_t of_eight = allocations_of(8), of_sixteen = allocations_of(16);
  EXPECT_LT(static_cast<double>(of_sixteen), 2.2 * static_cast<double>(of_eight));
}

}  // namespace
}  // namespace dpde
