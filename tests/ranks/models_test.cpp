// SPDX-License-Identifier: Apache-2.0
// Grids that are divided among ranks: runs, losses, gradients and products of second derivatives, against the same on
// the whole grid. Fields keep every bit. Odd numbers of cells, so that subgrids differ.
#include <gtest/gtest.h>

#include <atomic>

#include "dpde/runtime/layout.h"
#include "dpde/runtime/thread_ranks.h"
#include "ranks/divided_task.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

const std::vector<Ranks> divisions_2d{{1, 2, 1}, {3, 1, 1}, {2, 2, 1}};

std::string example(const std::string& file) {
  return read_file(std::string(DPDE_SOURCE_DIR) + "/dsl-examples/" + file);
}

/// Model, scheme, boundary lines and more of a scene on 13 x 11 cells, 6 steps; a task.
std::string plane(const std::string& model, const std::string& scheme, bool is_periodic, const std::string& scene,
                  const std::string& task = "unknown initial u from 0.5*x*(1 - y); minimise mean(u^2) at t = 0.06") {
  const std::string topology = is_periodic ? ", periodic" : "";
  return "model m {\n" + model + "\n}\nscheme c { " + scheme + " }\nscene s : m with c {\n  grid x = 0 .. 1, cells 13" +
         topology + "\n  grid y = 0 .. 0.8, cells 11" + topology + "\n" + scene +
         "\n  time 0 .. 0.06, step 0.01\n}\ntask t : s {\n  " + task + "\n}\n";
}

const char* const heat = "field u; param k; dt(u) = k*lap(u)";
const char* const heat_task =
    "unknown initial u from x*x*y\n  unknown k from 0.02\n  minimise mean(u^2*(1 + x)) at t = 0.03, 0.06";

TEST(Divided, HeatAroundARing) {
  DividedTask task(plane(heat, "lap = central(4); time = rk4", true,
                         "  k = 0.03\n  initial u = x*y\n"
                         "  observe total = integral(u)",
                         heat_task));
  expect_same(task, divisions_2d);
  expect_same(task, {{2, 2, 1}}, 1e-13, 0, {{.slots = 2}});
}

TEST(Divided, HeatBetweenWalls) {
  DividedTask task(plane(heat, "lap = central(4); time = rk4", false,
                         "  k = 0.03\n  boundary u = 0\n  initial u = x*y\n  observe total = integral(u)", heat_task));
  expect_same(task, divisions_2d);
}

TEST(Divided, HeatInABlock) {
  DividedTask task(
      "model m { field u; coefficient q; dt(u) = div(q*grad(u)) }\nscheme c { lap = central(4); time = rk2 }\n"
      "scene s : m with c {\n  grid x = 0 .. 1, cells 9, periodic\n  grid y = 0 .. 1, cells 11\n"
      "  grid z = 0 .. 1, cells 10, periodic\n  boundary u: y.low = mixed(1, 1, sin(x)), y.high = gradient(z)\n"
      "  q = 0.02 + 0.01*x*y*z\n  initial u = x*y*z\n  time 0 .. 0.04, step 0.01\n}\n"
      "task t : s { unknown q from 0.03; unknown initial u from x; minimise mean(u^2*z) at t = 0.04 }\n");
  expect_same(task, {{2, 1, 1}, {1, 2, 2}, {1, 1, 2}, {2, 2, 2}});
}

TEST(Divided, HeatInSinglePrecision) {
  DividedTask task(plane(heat, "time = euler; real = f32", false,
                         "  k = 0.03\n  boundary u: x = zero_gradient, y = 1\n  initial u = x*y", heat_task));
  expect_same(task, divisions_2d, 1e-6);
}

TEST(Divided, Burgers) {
  for (const char* scheme : {"precise", "plain"}) {
    DividedTask task(
        "scene s : burgers_2d with " + std::string(scheme) +
        " {\n  grid x = 0 .. 1, cells 13, periodic\n  grid y = 0 .. 1, cells 11, periodic\n  nu = 0.005\n"
        "  initial u = sin(2*pi*x)*cos(2*pi*y)\n  initial v = -cos(2*pi*x)*sin(2*pi*y) + 0.3*sin(4*pi*x)\n"
        "  observe energy = 0.5*mean(u^2 + v^2)\n  time 0 .. 1/16, step 1/128\n}\n"
        "task t : s {\n  data u_ref = u from scene s at t = 1/16\n  unknown initial u from 0.8*sin(2*pi*x)\n"
        "  unknown nu from 0.004\n  minimise mean((u - u_ref)^2) + mean(v^2) at t = 1/16\n}\n" +
        example("burgers_2d/burgers_2d.dpde"));
    expect_same(task, divisions_2d);
  }
}

/// 3-D, differences of order 8, a point source, receivers at the faces, and an unknown coefficient.
TEST(Divided, WaveOf25Points) {
  DividedTask task(example("wave/block.dpde"), "image", {.overrides = {{"cells", "17"}}});
  expect_same(task, {{2, 1, 1}, {1, 2, 2}});
}

TEST(Divided, StaggeredShallowWater) {
  DividedTask task(example("shallow_water/shallow_water.dpde"), "bank",
                   {.overrides = {{"cells", "11"}, {"step", "1/20"}}});
  expect_same(task, divisions_2d);
}

TEST(Divided, GrayScott) {
  DividedTask task(
      "scene s : gray_scott with plain {\n  grid x = 0 .. 0.13, cells 13, periodic\n"
      "  grid y = 0 .. 0.11, cells 11, periodic\n  Da = 2e-5\n  Db = 1e-5\n  F = 0.03\n  k = 0.062\n"
      "  initial a = 1 - 0.5*exp(-((x - 0.06)^2 + (y - 0.05)^2)/0.001)\n  initial b = 0.25*x\n  observe mean_b = "
      "mean(b)\n"
      "  time 0 .. 20, step 1\n}\n"
      "task t : s {\n  unknown F from 0.035\n  unknown k from 0.06\n"
      "  minimise mean((a - 0.9)^2) + mean(b^2) at t = 20\n}\n" +
      example("gray_scott/gray_scott.dpde"));
  expect_same(task, divisions_2d);
}

/// Formulas of coordinates in the equation, in an initial state and in a coefficient that hold unknowns.
TEST(Divided, FormulasOfPlaces) {
  DividedTask task(plane("field u; coefficient q; param a; dt(u) = dx(sin(x + a*y)*u) + q*dy(u) + cos(a*x*y)",
                         "dx = central(4); time = rk4", false,
                         "  boundary u = 0\n  a = 2\n  q = a*x - y\n  initial u = a*exp(-a*x)*y",
                         "unknown a from 1.5; minimise mean(u^2*x) over time"));
  expect_same(task, divisions_2d);
}

/// Numbers of cells.
TEST(Divided, Noise) {
  DividedTask task(plane("field u; param a; dt(u) = -advect((a, 1), u)", "advect = upwind(3); time = ssp_rk3", true,
                         "  a = -1\n  initial u = a*noise(3) + x",
                         "unknown a from -1.5; minimise mean(u^2*x) at t = 0.06"));
  expect_same(task, divisions_2d);
}

TEST(Divided, EachKindOfWall) {
  const char* const transport = "field u; coefficient g; param k, a; dt(u) = k*lap(u) + 0.3*dx(u) - 0.2*dy(u)";
  const std::vector<std::string> walls{
      "boundary u = a",
      "boundary u: x = zero_gradient, y = gradient(a)",
      "boundary u: x.low = mixed(a, 1, 0.2), x.high = linear, y = linear",
      "boundary u: x.low = sin(t)*y, x.high = gradient(y*a), y.low = g, y.high = x^2",
      "boundary u: x.low = g, x.high = outflow, y = zero_gradient",
      "boundary u: x = gradient(g), y.low = mixed(1, a, x), y.high = mixed(2, 1, g)",
  };
  for (const std::string& wall : walls) {
    SCOPED_TRACE(wall);
    DividedTask task(plane(transport, "lap = central(4); dx = central(4); time = rk4", false,
                           "  k = 0.02\n  a = 0.4\n  g = x + 2*y\n  " + wall + "\n  initial u = x*y",
                           "unknown initial u from x*y; unknown g from x - y; unknown a from 0.3; "
                           "minimise mean(u^2) at t = 0.03, 0.06"));
    expect_same(task, {{1, 2, 1}, {2, 1, 1}, {2, 2, 1}});
  }
}

/// Periodic along one axis, walls with a field along the other.
TEST(Divided, WallsOfAChannel) {
  std::string text =
      plane("field u; coefficient g; dt(u) = 0.02*lap(u) + 0.3*dx(u)", "lap = central(4); dx = central(4); time = rk4",
            true, "  g = sin(2*pi*x)\n  boundary u: y.low = g, y.high = gradient(g)\n  initial u = x*y",
            "unknown initial u from x*y; unknown g from cos(2*pi*x); minimise mean(u^2*x) at t = 0.06");
  const std::string last = "cells 11, periodic";
  text.replace(text.find(last), last.size(), "cells 11");
  DividedTask task(text);
  expect_same(task, divisions_2d);
}

TEST(Divided, WavesLeave) {
  DividedTask task(plane("field u; dt(dt(u)) = lap(u)", "lap = central(4); time = rk4", false,
                         "  boundary u: x = radiating(1), y.low = radiating(2), y.high = zero_gradient\n"
                         "  initial u = x*(1 - y)\n  initial dt(u) = y",
                         "unknown initial u from x*y; minimise mean(u^2) at t = 0.06"));
  expect_same(task, {{1, 2, 1}, {2, 2, 1}});
}

/// Values on the walls themselves.
TEST(Divided, FacesBetweenWalls) {
  for (const char* const wall :
       {"boundary v: x = 0, y = zero_gradient", "boundary v: x.low = 1, x.high = outflow, y = 0",
        "boundary v: x = mixed(1, 1, 0), y = linear"}) {
    SCOPED_TRACE(wall);
    DividedTask task(plane("field v on faces.x; field u; param k; dt(v) = k*lap(v) - dx(u); dt(u) = -dx(v)",
                           "dx = central(2); lap = central(2); time = rk4", false,
                           std::string("  k = 0.02\n  ") + wall +
                               "\n  boundary u = zero_gradient\n  initial u = x*y\n"
                               "  initial v = x*(1 - x)*y",
                           "unknown initial v from x*y; unknown k from 0.01; minimise mean(u^2 + v^2) at t = 0.06"));
    expect_same(task, divisions_2d);
  }
}

TEST(Divided, SourceAndReceivers) {
  DividedTask task(example("shallow_water/shallow_water.dpde"), "heap",
                   {.overrides = {{"cells", "41"}, {"step", "1/40"}}});
  expect_same(task, {{2, 1, 1}, {5, 1, 1}});
  DividedTask other(plane("field u; param a, b; dt(u) = 0.02*lap(u) + inject(sin(a*t), at = (b, 0.3))", "time = rk4",
                          false,
                          "  a = 3\n  b = 0.4\n  boundary u = zero_gradient\n  initial u = 0\n"
                          "  observe here = sample(u, at = (0.46, 0.37))",
                          "unknown a from 2; unknown b from 0.45\n"
                          "  minimise (sample(u, at = (0.5, 0.4)) - 0.01)^2, sum over time"));
  expect_same(other, divisions_2d);
}

/// The way back adds to places: what several cells of other ranks add to one is added up first.
TEST(Divided, CarriedAlongTheFlow) {
  for (const char* const along : {"semi_lagrangian", "semi_lagrangian(cubic)"}) {
    for (const bool is_periodic : {true, false}) {
      DividedTask task(plane("field u; param a; dt(u) = -advect((a*(1 + y), 9 - a*x), u)",
                             std::string("time = euler; advect = ") + along, is_periodic,
                             std::string("  a = 20\n  initial u = x*y\n") +
                                 (is_periodic ? "" : "  boundary u: x = 0.3, y = zero_gradient"),
                             "unknown initial u from sin(x*y); unknown a from 21; minimise mean(u^2*x) at t = 0.06"));
      expect_same(task, divisions_2d, 1e-12, 1e-13);
    }
  }
}

/// What is reduced along an axis that is divided is added up in another order: fields that hold it differ by rounding.
TEST(Divided, Reductions) {
  DividedTask task(plane("field u; dt(u) = 0.02*lap(u) + mean(u) - u^2 + 0.1*mean(u, over = x)", "time = rk4", false,
                         "  boundary u = zero_gradient\n  initial u = x*y\n  observe most = max(u)\n"
                         "  observe least = min(u)",
                         "unknown initial u from 0.5*x*(1 - y)\n"
                         "  minimise mean(u)^2 + (max(u) - 1)^2 + integral(u)^2 at t = 0.03, 0.06"));
  expect_same(task, divisions_2d, 1e-13, 1e-13);
}

/// Lines of one axis that is not divided, and largest values, are what they are on the whole grid.
TEST(Divided, ReductionsThatKeepEachBit) {
  DividedTask task(plane("field u; dt(u) = 0.02*lap(u) + 0.1*mean(u, over = x) + 0.1*max(u)", "time = rk4", false,
                         "  boundary u = zero_gradient\n  initial u = x*y"));
  expect_same(task, {{1, 2, 1}, {1, 5, 1}});
}

TEST(Divided, StepsInParts) {
  std::string text = plane("field u; dt(u) = -advect((1 + x, y), u)", "advect = upwind(1); time = euler", false,
                           "  boundary u = zero_gradient\n  initial u = x*y");
  text.replace(text.find("step 0.01"), 9, "step 0.02, courant 0.1");
  DividedTask by_courant(text);
  expect_same(by_courant, divisions_2d);
}

TEST(Divided, StepsUnderATolerance) {
  std::string text =
      plane("field u; dt(u) = 0.05*lap(u) - u^3", "time = bs32", false, "  boundary u = 0\n  initial u = x*y");
  text.replace(text.find("step 0.01"), 9, "step 0.03, tolerance 1e-6");
  DividedTask task(text);
  expect_same(task, divisions_2d, 1e-12, 1e-12);
}

TEST(Divided, Subcycles) {
  DividedTask task(plane("field u, w; dt(u) = 0.02*lap(u) + w; dt(w) = 0.02*lap(w) - u", "time = rk4", false,
                         "  subcycle w in 3\n  boundary u = 0\n  boundary w = zero_gradient\n"
                         "  initial u = x*y\n  initial w = x"));
  expect_same(task, divisions_2d);
}

TEST(Divided, ControlsOverTime) {
  DividedTask task(plane("field u; control field F; control a; dt(u) = 0.02*lap(u) + a*F", "time = rk4", false,
                         "  boundary u = 0\n  initial u = x*y\n  a = 0.5 every 0.02\n  F = x*t every 0.03",
                         "unknown F from y\n  unknown a from 1\n  minimise mean(u^2) at t = 0.06"));
  expect_same(task, divisions_2d);
}

/// All ranks learn of a value that is not finite, and of its cell by its number in the whole grid.
TEST(Divided, ABlowUpIsMetByAll) {
  DividedTask task(plane("field u; dt(u) = u^3", "time = euler", true, "  initial u = 0"));
  const auto run = [&](Communicator* rank, int64_t x, int64_t y) {
    EngineOptions options;
    options.ranks = rank;
    Engine engine(task.scene(), options, nullptr);
    const dpde_layout& layout = engine.workspace().layout();
    Rollout& rollout = engine.primary();
    engine.begin(rollout);
    const int64_t own_x = x - layout.first[0], own_y = y - layout.first[1];
    const bool is_own = own_x >= 0 && own_x < layout.cells[0] && own_y >= 0 && own_y < layout.cells[1];
    if (is_own) rollout.initial(0).set(1e200, own_x, own_y);
    return rollout.run();
  };
  const auto [x, y] = std::pair<int64_t, int64_t>{9, 7};
  const RunResult whole = run(nullptr, x, y);
  ASSERT_TRUE(whole.blow_up);
  std::array<RunResult, 4> found;
  run_ranks({2, 2, 1}, [&](Communicator& rank) {
    found[static_cast<std::size_t>(2 * rank.place()[1] + rank.place()[0])] = run(&rank, x, y);
  });
  for (const RunResult& own : found) {
    ASSERT_TRUE(own.blow_up);
    EXPECT_EQ(own.blow_up->step, whole.blow_up->step);
    EXPECT_EQ(own.blow_up->cell, (Cell{x, y, 0}));
    EXPECT_EQ(own.blow_up->cell, whole.blow_up->cell);
    EXPECT_EQ(own.blow_up->value, whole.blow_up->value);
    EXPECT_EQ(own.steps_done, whole.steps_done);
  }
}

/// One of them is told.
TEST(Divided, StopsAtAllRanks) {
  DividedTask task(plane("field u; dt(u) = 0.02*lap(u)", "time = euler", true, "  initial u = x"));
  std::atomic<bool> stop = false, all_stopped = true;
  run_ranks({2, 1, 1}, [&](Communicator& rank) {
    const std::atomic<bool> never = false;
    EngineOptions options;
    options.ranks = &rank;
    options.stop = rank.place()[0] == 0 ? &stop : &never;
    Engine engine(task.scene(), options, nullptr);
    engine.watch_gradients(
        [&](const GradientProgress& progress) {
          if (rank.place()[0] == 0 && progress.done == 3) stop = true;
          return true;
        },
        1);
    std::vector<double> gradient(engine.unknown_count());
    engine.gradient(gradient);
    if (!engine.was_stopped()) all_stopped = false;
  });
  EXPECT_TRUE(all_stopped);
}

/// The same tables by the other back end.
TEST(Divided, EmittedCpp) {
  DividedTask task(plane(heat, "lap = central(4); time = euler", false,
                         "  k = 0.03\n  boundary u: x = 0, y = zero_gradient\n  initial u = x*y", heat_task),
                   "t", {.backend = driver::Backend::cpp});
  expect_same(task, {{2, 2, 1}});
}

}  // namespace
}  // namespace dpde::testing
