// SPDX-License-Identifier: Apache-2.0
// Nested differences of high order, whose inner values a step stores once (stencil/passes/displaced_values.h): code
// size grows with the sum of the widths; walls act as mirrors; back ends agree; derivatives are exact.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "../driver/driver_support.h"
#include "driver/scene/session.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/passes/displaced_values.h"
#include "stencil/passes/work.h"
#include "stencil/text/print_stencil.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

struct Nested {
  const char *name, *fields, *equations, *initial, *walls;
};
/// Even or odd about the walls of x and y: equal to the fields of a ring twice as long.
constexpr Nested nested[] = {
    {"mixture", "field u", "dt(u) = 1e-5*lap(u^3 - u - 1e-3*lap(u*lap(u)))", "initial u = 0.3 + cos(pi*x)*cos(pi*y)",
     "boundary u: zero_gradient"},
    {"plate", "field u", "dt(u) = -1e-9*lap((1 + u^2)*lap((1 + u^2)*lap(u)))", "initial u = sin(pi*x)*cos(pi*y)",
     "boundary u: x = 0, y = zero_gradient"},
    {"water", "vector w on faces; field e",
     "let flux = interpolate(e)*w\ndt(w) = -cross(curl(w)/interpolate(e), flux) - grad(g*e + 0.5*dot(w, w))\n"
     "dt(e) = -div(flux)",
     "initial w = (0.2*sin(pi*x)*cos(pi*y), 0.1*cos(pi*x)*sin(pi*y)); initial e = 1 + 0.1*cos(pi*x)*cos(pi*y)",
     "boundary w.x: x = 0, y = zero_gradient; boundary w.y: x = zero_gradient, y = 0; boundary e: zero_gradient"},
};
constexpr int cells_along[] = {6, 5};

/// `walls`: whether x and y have walls; otherwise the axis is a ring twice as long.
std::string text_of(const Nested& one, int order, std::array<bool, 2> walls, const std::string& time) {
  std::string grid;
  for (std::size_t a = 0; a < 2; ++a)
    grid += fmt::format("grid {} = 0 .. {}, cells {}{}\n", "xy"[a], walls[a] ? 1 : 2,
                        cells_along[a] * (walls[a] ? 1 : 2), walls[a] ? "" : ", periodic");
  std::string sides = one.walls;
  if (!walls[0] && !walls[1]) sides.clear();
  for (std::size_t a = 0; a < 2; ++a) {
    if (walls[a] || sides.empty()) continue;
    const std::string other = a == 0 ? "y" : "x";
    sides = std::regex_replace(sides, std::regex(": zero_gradient"), ": " + other + " = zero_gradient");
    sides =
        std::regex_replace(sides, std::regex(fmt::format("({0} = [a-z_0-9]+, )|(, {0} = [a-z_0-9]+)", "xy"[a])), "");
  }
  return fmt::format(
      "model m {{ {}; param g = 0.7\n{} }}\nscheme p {{ time = {}; dx = central({}); lap = central({}) }}\n"
      "scene s : m with p {{\n{}{}\n{}\ntime 0 .. 0.03, step 0.01 }}\n"
      "task t : s {{ unknown g; {} minimise {} }}\n",
      one.fields, one.equations, time, order, order, grid, sides, one.initial,
      std::string(one.fields).find(" e") != std::string::npos ? "unknown initial e; unknown initial w;"
                                                              : "unknown initial u;",
      std::string(one.fields).find(" e") != std::string::npos ? "mean((e - 1)^2 + 0.1*e*dot(w, w))"
                                                              : "mean(g*u^2 + u^3)");
}

/// By day only the first one.
const std::vector<const char*> times = {"rk2", "ab3", "backward_euler; implicit = all"};
constexpr std::array<std::array<bool, 2>, 4> topologies{{{false, false}, {true, true}, {true, false}, {false, true}}};

/// Loads, operations and streams of all kernels of the step.
int work_of_step(const std::string& text, int* kernels = nullptr) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "s";
  const auto code = compiled(source, options);
  if (!code) return 0;
  int work = 0, count = 0;
  for (const stencil::Kernel& kernel : code->stencil.kernels) {
    if (!kernel.name.starts_with("s_step")) continue;
    work += stencil::instructions(kernel);
    ++count;
  }
  if (kernels != nullptr) *kernels = count;
  return work;
}

TEST(NestedDifferences, GrowWithTheSumOfTheWidths) {
  for (const Nested& one : nested) {
    for (const std::array<bool, 2> walls : {topologies[0], topologies[1]}) {
      int kernels = 0;
      const int of_two = work_of_step(text_of(one, 2, walls, "euler"));
      const int of_six = work_of_step(text_of(one, 6, walls, "euler"), &kernels);
      EXPECT_GT(kernels, 1) << one.name;
      EXPECT_LT(of_six, 4 * of_two) << one.name << ": differences are three times as wide, in values that are stored";
    }
  }
}

/// Nested ghost values are mirror values.
TEST(NestedDifferences, AreThoseOfARingBesideTheMirrors) {
  for (const Nested& one : nested) {
    for (const int order : is_thorough() ? std::vector{4, 6} : std::vector{4}) {
      const char* time = is_thorough() ? "rk4" : "euler";
      const SceneResult ring = run_scene(text_of(one, order, topologies[0], time), "s");
      for (std::size_t k = 1; k < topologies.size(); ++k) {
        const SceneResult walls = run_scene(text_of(one, order, topologies[k], time), "s");
        const auto row = static_cast<std::size_t>(2 * cells_along[0]);
        const std::size_t cells = static_cast<std::size_t>(cells_along[0]) * (topologies[k][0] ? 1 : 2);
        for (const auto& [name, values] : walls.state) {
          double moved = 0;
          for (std::size_t i = 0; i < values.size(); ++i) {
            const double other = ring.state.at(name)[i / cells * row + i % cells];
            moved = std::max(moved, std::abs(other));
            EXPECT_NEAR(values[i], other, 1e-13) << one.name << " " << order << " " << name << " " << i;
          }
          EXPECT_GT(moved, 1e-3);
        }
      }
    }
  }
}

TEST(NestedDifferences, AreTheSameForTheInterpreter) {
  for (const Nested& one : nested) {
    for (const std::array<bool, 2> walls : topologies) {
      for (const char* time : times) {
        if (!is_thorough() && time != times.front()) continue;
        const std::string text = text_of(one, 4, walls, time);
        const SceneResult jit = run_scene(text, "s"), other = run_scene(text, "s", {}, driver::Backend::interpreter);
        for (const auto& [name, values] : jit.state) {
          for (std::size_t i = 0; i < values.size(); ++i)
            EXPECT_NEAR(values[i], other.state.at(name)[i], 1e-11) << text << name << " " << i;
        }
      }
    }
  }
}

/// On small grids, where a value can also be its own mirror value.
TEST(NestedDifferences, HaveDerivatives) {
  for (std::size_t count = 0; const Nested& one : nested) {
    for (const std::array<bool, 2> walls : topologies) {
      for (const char* time : times) {
        if (!is_thorough() && (walls != topologies[1] || time != times.front())) continue;
        if (!is_tried(count++, 2)) continue;
        const SourceFile source("test.dpde", text_of(one, 4, walls, time));
        driver::CompileOptions options;
        options.selection.name = "t";
        options.adjoint = options.tangent = options.second = true;
        options.backend = driver::Backend::jit;
        DiagnosticSink sink;
        const auto code = compiled(source, options);
        ASSERT_TRUE(code) << source.text();
        const auto certificate = analysis::certify(source, code, {}, sink);
        ASSERT_TRUE(certificate) << all_messages(source, sink) << source.text();
        EXPECT_TRUE(certificate->passed() && !certificate->tests_nothing())
            << certificate->worst() << " " << certificate->note << source.text();
      }
    }
  }
}

/// Operands of a comparison are not stored but computed as written, with the same rounding: in the middle of 17 columns
/// it is 0.
TEST(NestedDifferences, StayInDecisionsAsTheyAreWritten) {
  const std::string text =
      "model m { field u; field v\ndt(u) = 0\n"
      "dt(v) = if(dx(dy(u*dx(u*dx(u*dy(u*u))))) > 0, 1, 0) + 1e-9*dx(u*dy(u*dx(u*dy(u*u)))) }\n"
      "scheme q { time = euler; dx = central(4) }\nscene s : m with q {\n"
      "grid x = 0 .. 17, cells 17, periodic; grid y = 0 .. 8, cells 8, periodic; time 0 .. 1, step 1\n"
      "initial u = 0.3 + 0.137*(x - 8.5)^2/71 + 0.0177*y*((x - 8.5)^2 - 3.3); initial v = 0 }\n";
  for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::interpreter}) {
    const SceneResult result = run_scene(text, "s", {}, backend);
    EXPECT_EQ(std::ranges::count_if(result.state.at("v"), [](double v) { return v > 0.5; }), 64);
  }
}

std::vector<std::vector<double>> end_of(const SourceFile& source, std::shared_ptr<const driver::Compiled> code) {
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, std::move(code), {}, sink);
  std::vector<std::vector<double>> states;
  if (!session) return states;
  session->rollout().run();
  for (void* state : session->rollout().final_states()) {
    copy_out(session->workspace().layout(), state, states.emplace_back(session->workspace().cell_count()));
  }
  return states;
}

/// Substituting the stored values back gives the original step up to rounding, and none of them remains.
TEST(NestedDifferences, CanBePutBack) {
  for (const Nested& one : nested) {
    for (const std::array<bool, 2> walls : topologies) {
      const SourceFile source("test.dpde", text_of(one, 4, walls, "euler"));
      driver::CompileOptions options;
      options.selection.name = "s";
      options.backend = driver::Backend::jit;
      const auto code = compiled(source, options);
      ASSERT_TRUE(code) << source.text();
      const auto whole = std::make_shared<driver::Compiled>(*code);
      whole->stencil = stencil::with_values_in_place(code->stencil);
      EXPECT_EQ(stencil::print(whole->stencil).find("operand"), std::string::npos) << source.text();
      EXPECT_EQ(stencil::verify(whole->stencil), std::vector<std::string>{}) << source.text();
      if (walls[0] == walls[1]) EXPECT_NE(stencil::print(code->stencil).find("operand"), std::string::npos);
      compile_stencil_again(*whole);
      const auto expected = end_of(source, code), found = end_of(source, whole);
      ASSERT_EQ(found.size(), expected.size());
      ASSERT_FALSE(expected.empty());
      for (std::size_t k = 0; k < expected.size(); ++k) {
        for (std::size_t i = 0; i < expected[k].size(); ++i)
          EXPECT_NEAR(found[k][i], expected[k][i], 1e-13) << source.text() << k << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace dpde::testing
