// SPDX-License-Identifier: Apache-2.0
// Order of the stages, selection of derivatives, and the interpreter as a back end.
#include <cmath>
#include <vector>

#include "driver/scene/session.h"
#include "driver_support.h"

namespace dpde::testing {
namespace {

const char* plate_text = R"(model m {
  field u
  field v
  param k
  dt(u) = k*lap(u) - advect((u, v), u)
  dt(v) = k*lap(v) + u*v
}
scene plate : m {
  grid x = 0 .. 1, cells 5
  grid y = 0 .. 1, cells 3, periodic
  boundary u: x.low = 0.5, x.high = zero_gradient
  boundary v: all = 0
  k = 0.01
  initial u = sin(x + y)
  initial v = x*cos(y)
  time 0 .. 0.2, step 0.05
}
task find : plate {
  unknown k
  minimise mean(u^2) + mean(v) at t = 0.2
}
)";

TEST(Pipeline, ObservesTheStagesInOrder) {
  const SourceFile source("plate.dpde", plate_text);
  std::vector<std::string> stages;
  driver::CompileOptions options;
  options.selection.name = "find";
  options.tangent = options.adjoint = true;
  options.after = [&](std::string_view stage, const std::function<std::string()>& text) {
    stages.emplace_back(stage);
    EXPECT_FALSE(text().empty()) << stage;
  };
  ASSERT_NE(compiled(source, options), nullptr);
  EXPECT_EQ(stages, (std::vector<std::string>{"ast", "model", "stencil", "tangent", "adjoint", "loop"}));
}

TEST(Pipeline, DifferentiatesWhatATaskAsksFor) {
  const SourceFile source("plate.dpde", plate_text);
  driver::CompileOptions options;
  options.selection.name = "find";
  options.adjoint = true;
  const auto task = compiled(source, options);
  ASSERT_NE(task, nullptr);
  EXPECT_EQ(task->activity.fields, (std::set<std::string>{"u", "v"}));
  EXPECT_EQ(task->activity.params, (std::set<std::string>{"k"}));
  EXPECT_EQ(task->derivative_programs(true), (std::vector<std::string>{"plate_step_adjoint", "find_loss_1_adjoint"}));
  EXPECT_TRUE(task->derivative_programs(false).empty());
  options.selection.name = "plate";
  const auto scene = compiled(source, options);
  ASSERT_NE(scene, nullptr);
  EXPECT_TRUE(scene->activity.params.empty());
  options.selection.name = "find";
  options.without_task = true;
  EXPECT_FALSE(compiled(source, options)->problem->task.has_value());
}

TEST(Pipeline, ABrokenFileStopsAtItsStage) {
  const SourceFile source("plate.dpde", "model m { field u\n dt(u) = k }\nscene s : m {\n}\n");
  DiagnosticSink sink;
  std::vector<std::string> stages;
  driver::CompileOptions options;
  options.after = [&](std::string_view stage, const std::function<std::string()>&) { stages.emplace_back(stage); };
  EXPECT_FALSE(driver::compile(source, options, sink).has_value());
  EXPECT_TRUE(sink.has_errors());
  EXPECT_EQ(stages, std::vector<std::string>{"ast"});
}

TEST(Pipeline, BackEndsAgreeOnEverySmallExtent) {
  const SourceFile source("plate.dpde", plate_text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "plate";
  options.backend = driver::Backend::interpreter;
  const auto truth = compiled(source, options);
  options.backend = driver::Backend::jit;
  const auto jit = compiled(source, options);
  ASSERT_TRUE(truth && jit);
  for (int nx = 1; nx <= 4; ++nx) {
    for (int ny = 1; ny <= 4; ++ny) {
      driver::SessionOptions grid;
      grid.cells = {nx, ny};
      const auto a = driver::Session::open(source, truth, grid, sink),
                 b = driver::Session::open(source, jit, grid, sink);
      ASSERT_TRUE(a && b) << all_messages(source, sink);
      a->rollout().run();
      b->rollout().run();
      for (int s = 0; s < 2; ++s) {
        const std::vector<double> u = a->final_state(s), v = b->final_state(s);
        ASSERT_EQ(u.size(), std::size_t(nx * ny));
        for (std::size_t i = 0; i < u.size(); ++i) {
          EXPECT_TRUE(std::isfinite(u[i]));
          EXPECT_NEAR(u[i], v[i], 1e-14) << nx << " x " << ny;
        }
      }
    }
  }
}

TEST(Pipeline, ExtractsProgramsWithTheirKernels) {
  const SourceFile source("plate.dpde", plate_text);
  driver::CompileOptions options;
  options.selection.name = "plate";
  options.adjoint = true;
  const auto all = compiled(source, options);
  ASSERT_NE(all, nullptr);
  const stencil::Module initial = driver::extract(all->stencil, {"plate_initial"});
  ASSERT_EQ(initial.programs.size(), 1u);
  ASSERT_EQ(initial.kernels.size(), 1u);
  EXPECT_EQ(initial.kernels[0].name, "plate_initial");
  EXPECT_TRUE(initial.loops.empty());
}

}  // namespace
}  // namespace dpde::testing
