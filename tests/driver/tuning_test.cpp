// SPDX-License-Identifier: Apache-2.0
// Measured choices of the fastest way to sweep are stored in the cache, used by the next run, and change no result.
#include "driver/memory/tuning.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "driver/memory/cache_folder.h"
#include "driver/scene/session.h"
#include "driver_support.h"

namespace dpde::driver {
namespace {

/// A mean, so that steps are not blocked; 4.9 MB per field.
const std::string plate = R"(
model heat { field u; param kappa; dt(u) = kappa*lap(u) - mean(u)*dx(u) }
scheme s { time = euler }
scene go : heat with s {
  grid x = 0 .. 1, cells 1024
  grid y = 0 .. 1, cells 600
  boundary u: x = 0.5, y = zero_gradient
  kappa = 1
  initial u = sin(9*x)*cos(7*y)
  time 0 .. 6e-6, step 1e-7
})";

struct Ran {
  std::string before, after;  // tuning
  std::vector<double> state;
};

Ran run(const std::filesystem::path& folder) {
  const SourceFile source("plate.dpde", plate);
  DiagnosticSink sink;
  CompileOptions options;
  options.backend = Backend::jit;
  if (!folder.empty()) options.cache = open_cache(folder);
  const auto session = Session::open(source, testing::compiled(source, options), {}, sink);
  EXPECT_TRUE(session) << testing::all_messages(source, sink);
  Ran ran{session->rollout().tuning(), {}, {}};
  EXPECT_EQ(session->rollout().run().steps_done, 60);
  ran.after = session->rollout().tuning();
  ran.state = session->final_state(0);
  return ran;
}

TEST(Tuning, IsKeptAndChangesNoResult) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "tuning_cache";
  std::filesystem::remove_all(folder);
  const Ran first = run(folder), second = run(folder), without = run({});
  EXPECT_EQ(first.before, "");
  EXPECT_TRUE(first.after.starts_with("go_step\n")) << first.after;
  EXPECT_EQ(second.before, first.after);
  EXPECT_EQ(second.after, first.after);
  EXPECT_EQ(without.before, "");
  EXPECT_EQ(second.state, first.state);
  EXPECT_EQ(without.state, first.state);
}

/// 73 planes of 80 rows of 97 cells (4.9 MB per field), walls along two axes, a sum over all cells.
const std::string room = R"(
model heat { field u; param kappa; dt(u) = kappa*lap(u) - mean(u)*dx(u) }
scheme s { time = euler }
scene go : heat with s {
  grid x = 0 .. 1, cells 97
  grid y = 0 .. 1, cells 80
  grid z = 0 .. 1, cells 73, periodic
  boundary u: x = 0.5, y = zero_gradient
  kappa = 1
  initial u = sin(9*x)*cos(7*y)*(1 + z)
  time 0 .. 1, step 1e-7
})";

/// Bits of the step's results and sums after one step with the choices in `tuning`.
std::vector<double> step_once(const Compiled& compiled, int threads, const std::string& tuning) {
  const dpde_program& program = *compiled.program(compiled.step_name());
  const dpde_layout layout = make_layout(std::vector<int64_t>{97, 80, 73}, {1, 1, 1}, DPDE_F64);
  Executor executor(program, layout, threads);
  std::vector<Field> fields;
  for (int f = 0; f < program.field_count; ++f) {
    double* start = fields.emplace_back(layout, f).as<double>();
    for (int64_t i = 0; i < layout.size; ++i) start[i - layout.origin] = std::sin(0.37 * static_cast<double>(i)) + f;
    executor.bind(f, start);
  }
  for (int p = 0; p < program.param_count; ++p) executor.set_param(p, 0.01 + 0.1 * p);
  executor.update_uniforms();
  executor.prepare();
  executor.set_tuning(tuning);
  EXPECT_EQ(executor.tuning(), tuning);
  executor.run();
  std::vector<double> values(executor.sums().begin(), executor.sums().end());
  for (const Field& field : fields)
    values.insert(values.end(), field.as<double>() - layout.origin, field.as<double>() - layout.origin + layout.size);
  return values;
}

TEST(Tuning, PlanesDoneTogetherChangeNoResult) {
  const SourceFile source("room.dpde", room);
  const auto compiled = testing::compiled(source, {.backend = Backend::jit});
  const auto ways = [](int tile, int planes) { return fmt::format("0 0 {} {}\n", tile, planes); };
  const std::vector<double> wanted = step_once(*compiled, 1, ways(80, 1));
  EXPECT_EQ(step_once(*compiled, 1, ways(80, 2)), wanted);
  EXPECT_EQ(step_once(*compiled, 2, ways(80, 2)), wanted);
  EXPECT_EQ(step_once(*compiled, 3, ways(40, 2)), wanted);
}

/// Cells times steps times runs, if they are known.
TEST(Tuning, CodeOfShortRunsIsNotOptimised) {
  const auto is_worth = [](const std::string& time, const std::string& task = "", double runs = 1) {
    const SourceFile source("ring.dpde",
                            "model heat { field u; param k; dt(u) = k*lap(u) }\nscheme s { time = bs32 }\n"
                            "scene go : heat with s {\n  grid x = 0 .. 1, cells 500, periodic\n  k = 1e-7\n"
                            "  initial u = sin(2*pi*x)\n  " +
                                time + "\n}\n" +
                                (task.empty() ? "" : "task find : go { unknown k; minimise mean(u^2)" + task + " }\n"));
    CompileOptions options;
    options.selection.name = task.empty() ? "go" : "find";
    options.runs = runs;
    const auto code = testing::compiled(source, options);
    return code != nullptr && is_worth_optimising(*code);
  };
  EXPECT_FALSE(is_worth("time 0 .. 1, step 1/1000"));
  EXPECT_TRUE(is_worth("time 0 .. 1, step 1/1001"));
  EXPECT_FALSE(is_worth("time 0 .. 1, step 1/100", "\n "));
  EXPECT_TRUE(is_worth("time 0 .. 1, step 1/101", "\n ")) << "a certificate makes ten runs";
  EXPECT_FALSE(is_worth("time 0 .. 1, step 1/10", "\n using lbfgs, iterations 33"));
  EXPECT_TRUE(is_worth("time 0 .. 1, step 1/10", "\n using lbfgs, iterations 34"));
  EXPECT_FALSE(is_worth("time 0 .. 1, step 1/10", "", 100));
  EXPECT_TRUE(is_worth("time 0 .. 1, step 1/10", "", 101));
  EXPECT_TRUE(is_worth("time 0 .. 1, step 1", "", any_number_of_runs));
  for (const char* const unknown : {"time 0 .. 1, step 1, courant 0.5, speed 1", "time 0 .. 1, step 1, tolerance 1e-3",
                                    "time 0 .. 1, step 1, until steady 1e-3"})
    EXPECT_TRUE(is_worth(unknown)) << unknown;
}

}  // namespace
}  // namespace dpde::driver
