// SPDX-License-Identifier: Apache-2.0
// Temporal blocking: several steps in one pass give the states of single steps bit for bit, including ghost cells, for
// every kind of axis, number of threads, integrator and number of steps per block; programs that cannot be blocked
// still run.
#include <gtest/gtest.h>

#include <cmath>

#include "driver/scene/session.h"
#include "driver_support.h"

namespace dpde::driver {
namespace {

using testing::grid;

struct BlockingCase {
  std::string name, text;
  bool blocks = true;
};

std::string heat(const std::string& axes, const std::string& walls, const std::string& scheme) {
  return "model heat { field u; coefficient q; param kappa; dt(u) = kappa*lap(u) + q*t - u*dx(u) }\nscheme s { " +
         scheme + " }\nscene go : heat with s {\n" + axes + walls +
         "kappa = 0.01\nq = 1 + x\ninitial u = 0\ntime 0 .. 1, step 1e-3\n}\n";
}

std::vector<BlockingCase> blocking_cases() {
  const std::string walls_y = "boundary u: y.low = 1, y.high = zero_gradient\n";
  // The reader of f needs rows below those where f is computed.
  const std::string one_sided =
      "kernel a(u: field halo 1, out f: field) { f = 0.5*u[0, +1] + 0.4*u[+1, 0] + 0.1*u[-1, 0] }\n"
      "kernel b(u: field halo 1, f: field halo 1, out v: field) { v = 0.4*u[0, -1] + 0.6*f[0, +1] }\n"
      "program p { fill u periodic; run a; fill f periodic; run b; swap u, v }\nscene go : p {\n" +
      grid("x", 4000, true) + grid("y", 60, true) + "initial u = 0\ntime 0 .. 1, step 1e-3\n}\n";
  const std::string walls = "boundary u: x = 0.5, y.low = 1, y.high = zero_gradient\n";
  return {
      {"periodic", heat(grid("x", 21, true) + grid("y", 40, true), "", "time = euler")},
      {"walls", heat(grid("x", 17, false) + grid("y", 40, false), walls, "time = euler")},
      {"mixed", heat(grid("x", 17, true) + grid("y", 40, false), walls_y, "time = rk2")},
      {"rk4", heat(grid("x", 17, true) + grid("y", 90, true), "", "time = rk4; lap = central(4)")},
      {"rk4_walls",
       heat(grid("x", 17, true) + grid("y", 90, false), walls_y, "time = rk4; lap = central(4); dx = central(4)")},
      {"upwind",
       "model carry { field u, v; dt(u) = -advect((1, v), u); dt(v) = -dx(v) }\nscheme s { time = euler; advect = "
       "upwind(1) }\nscene go : carry with s {\n" +
           grid("x", 17, true) + grid("y", 40, true) + "initial u = 0\ninitial v = 0\ntime 0 .. 1, step 1e-3\n}\n"},
      {"strips", heat(grid("x", 1500, true) + grid("y", 40, true), "", "time = rk2")},
      {"strips_walls", heat(grid("x", 1500, false) + grid("y", 40, false), walls, "time = rk4; dx = central(4)")},
      {"strips_mixed", heat(grid("x", 1500, true) + grid("y", 40, false), walls_y, "time = rk4")},
      {"one_sided", one_sided},
      {"3d", heat(grid("x", 9, true) + grid("y", 40, true) + grid("z", 40, true), "", "time = euler")},
      {"3d_walls", heat(grid("x", 9, false) + grid("y", 33, false) + grid("z", 40, false),
                        walls + "boundary u: z.low = 2, z.high = 0\n", "time = rk2")},
      {"3d_mixed", heat(grid("x", 9, true) + grid("y", 60, false) + grid("z", 60, true), walls_y,
                        "time = euler; lap = central(4)")},
      {"subcycle",
       "model two { field a, b; dt(a) = lap(a)/500 - a*b; dt(b) = lap(b)/500 + a }\nscheme s { time = rk2 }\nscene go "
       ": two with s {\n" +
           grid("x", 17, true) + grid("y", 90, true) +
           "initial a = 0\ninitial b = 0\ntime 0 .. 1, step 1e-3\nsubcycle b in 3\n}\n",
       false},
      {"repeat",
       "kernel k(u: field halo 1, out v: field, dt: param) { v = u + dt*(u[+1, 0] - 2*u + u[-1, 0] + u*(u[0, +1] - "
       "u[0, -1])) }\n"
       "program step { repeat 3 { fill u x periodic, y = zero_gradient; run k; swap u, v } }\nscene go : step {\n" +
           grid("x", 17, true) + grid("y", 60, false) + "initial u = 0\ntime 0 .. 1, step 1e-3\n}\n"},
      {"tiny", heat(grid("x", 3, true) + grid("y", 2, true), "", "time = euler"), false},
      {"reduction",
       "model m { field u; dt(u) = lap(u) - mean(u, x) }\nscheme s { time = euler }\nscene go : m with s {\n" +
           grid("x", 17, true) + grid("y", 40, true) + "initial u = 0\ntime 0 .. 1, step 1e-5\n}\n",
       false},
      {"line", heat(grid("x", 50, true), "", "time = euler"), false},
  };
}

/// The states after 9 steps, including ghost cells.
std::vector<double> states_after(Session& session, int block_steps, int threads, bool blocks) {
  RolloutSetup setup = session.setup();
  setup.steps = 9;
  setup.block_steps = block_steps;
  setup.team = threads;
  Rollout rollout(setup);
  EXPECT_EQ(rollout.block_steps(), blocks ? block_steps : 1);
  for (int s = 0; s < rollout.state_count(); ++s) {
    Field& field = rollout.initial(s);
    const dpde_layout& layout = field.layout();
    for (int64_t z = 0; z < layout.cells[2]; ++z) {
      for (int64_t y = 0; y < layout.cells[1]; ++y) {
        for (int64_t x = 0; x < layout.cells[0]; ++x)
          field.set(std::sin(1.0 + 13 * x + 7.3 * y + 3.1 * z + s), x, y, z);
      }
    }
  }
  const RunResult done = rollout.run();
  EXPECT_EQ(done.steps_done, 9);
  std::vector<double> values;
  const dpde_layout& layout = setup.layout;
  for (const void* base : rollout.final_states()) {
    for (int64_t z = -layout.halo[2]; z < layout.cells[2] + layout.halo[2]; ++z) {
      for (int64_t y = -layout.halo[1]; y < layout.cells[1] + layout.halo[1]; ++y) {
        for (int64_t x = -layout.halo[0]; x < layout.cells[0] + layout.halo[0]; ++x)
          values.push_back(value_at(layout, base, {x, y, z}));
      }
    }
  }
  return values;
}

void expect_states_of_single_steps(const BlockingCase& example, Precision real) {
  SCOPED_TRACE(example.name);
  const SourceFile source("blocking.dpde", example.text);
  DiagnosticSink sink;
  CompileOptions options;
  options.backend = Backend::jit;
  options.real = real;
  const auto session = Session::open(source, testing::compiled(source, options), {}, sink);
  ASSERT_TRUE(session) << testing::all_messages(source, sink);
  const std::vector<double> expected = states_after(*session, 1, 1, false);
  for (const double value : expected) ASSERT_TRUE(std::isfinite(value));
  for (const int steps : {2, 3, 4, 8}) {
    for (const int threads : {1, 2, 3})
      EXPECT_EQ(states_after(*session, steps, threads, example.blocks), expected)
          << steps << " steps, " << threads << " threads";
  }
}

TEST(Blocking, StatesAreThoseOfSingleSteps) {
  for (const BlockingCase& example : blocking_cases()) expect_states_of_single_steps(example, Precision::f64);
}

TEST(Blocking, StatesAreThoseOfSingleStepsInSinglePrecision) {
  for (const BlockingCase& example : blocking_cases()) expect_states_of_single_steps(example, Precision::f32);
}

/// Number of steps per block that a run chooses automatically.
int chosen_steps(const std::string& text) {
  const SourceFile source("block.dpde", text);
  DiagnosticSink sink;
  const auto session = Session::open(source, testing::compiled(source, {.backend = Backend::jit}), {}, sink);
  EXPECT_TRUE(session) << testing::all_messages(source, sink);
  return session->rollout().block_steps();
}

TEST(Blocking, IsChosenWhereItPays) {
  const std::string axes = grid("x", 64, true) + grid("y", 96, true) + grid("z", 96, true);
  EXPECT_GE(chosen_steps(heat(axes, "", "time = euler")), 4);
  EXPECT_EQ(chosen_steps(heat(axes, "", "time = euler; lap = central(4)")), 1)
      << "planes two away are read from the shared cache";
  EXPECT_GE(chosen_steps(heat(grid("x", 512, true) + grid("y", 512, true), "", "time = euler; lap = central(4)")), 4);
  EXPECT_EQ(chosen_steps(heat(grid("x", 64, true) + grid("y", 64, true), "", "time = euler")), 1)
      << "it fits the core's cache";
}

}  // namespace
}  // namespace dpde::driver
