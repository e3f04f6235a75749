// SPDX-License-Identifier: Apache-2.0
// Scenes of programs with repeats: the compiled code does not grow with the count, memory is planned for the values
// that passes save, and derivatives of both orders are certified.
#include <regex>

#include "analysis/certificate/quick_certificate.h"
#include "codegen/cpp/emit_cpp.h"
#include "driver/memory/memory_plan.h"
#include "driver/memory/storage.h"
#include "driver_support.h"
#include "loop/print_loop.h"
#include "source/render.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

std::string task_of(const std::string& kernel, int count) {
  return "kernel k(u: field halo 1, c: field, out v: field, sum e: param, nu, dt, hx: param) {\n  v = " + kernel +
         "\n  e += u^2\n}\nprogram step { repeat " + std::to_string(count) +
         " { fill u x = 0.1; run k; swap u, v } }\nscene rod : step {\n"
         "  grid x = 0 .. 1, cells 12\n  nu = 0.01\n  c = 1 + x\n  initial u = sin(pi*x)\n  time 0 .. 0.04, step 0.01\n"
         "}\ntask t : rod {\n  unknown nu\n  unknown c\n  unknown initial u\n  minimise mean((u - 0.2)^2) at t = 0.02, "
         "0.04\n"
         "  using lbfgs()\n}\n";
}
const std::string quadratic = "u + dt*c*(nu*(u[-1] - 2*u + u[+1])/hx^2 - u^2)/4";
const std::string linear = "u + dt*c*nu*(u[-1] - 2*u + u[+1])/hx^2";

std::shared_ptr<const driver::Compiled> compiled_task(const std::string& kernel, int count) {
  const SourceFile source("test.dpde", task_of(kernel, count));
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.tangent = options.adjoint = options.second = true;
  return compiled(source, options);
}

TEST(RepeatedScene, CompilesTheSameCodeForAnyCount) {
  const auto few = compiled_task(quadratic, 4), many = compiled_task(quadratic, 4000);
  ASSERT_TRUE(few && many);
  const std::regex counts("repeat [0-9]+|stacks .*");
  const auto text = [&](const driver::Compiled& scene) {
    return std::regex_replace(print(scene.loop) + codegen::emit_cpp(scene.loop), counts, "");
  };
  EXPECT_EQ(text(*few), text(*many));
}

TEST(RepeatedScene, PlansMemoryForWhatPassesSave) {
  const auto bytes = [](const std::string& kernel, int count) {
    const auto scene = compiled_task(kernel, count);
    const std::optional<GradientPlan> plan = driver::plan_of_gradient(*scene, {});
    EXPECT_TRUE(plan);
    if (!plan) return std::int64_t{0};
    std::int64_t bytes = plan->field_bytes;
    for (const OwnedMemory& owned : plan->owned) bytes += owned.kept;
    return bytes;
  };
  // Six cache lines of 64 bytes for 12 cells, with ghost cells, alignment and position; rounded up to pages in total.
  const std::int64_t some = bytes(quadratic, 4000), many = bytes(quadratic, 8000);
  EXPECT_NEAR(static_cast<double>(many - some), 4000 * (384 + 8), 4096);
}

/// 2e9 passes of 12 cells: refused before anything is allocated.
TEST(RepeatedScene, IsRefusedWhereItsGradientDoesNotFitIntoMemory) {
  const int many = 2'000'000'000;
  const auto scene = compiled_task(quadratic, many);
  const SourceFile source("test.dpde", task_of(quadratic, many));
  DiagnosticSink sink;
  EXPECT_TRUE(driver::run_fits(*scene, source, sink)) << "which saves nothing";
  EXPECT_FALSE(driver::gradient_fits(*scene, {}, source, sink));
  ASSERT_EQ(sink.all().size(), 1u);
  const std::string text = render_text(source, sink.all()[0], false);
  EXPECT_EQ(text.find("test.dpde:13:6: error[E0903]: a gradient of task t needs 730 GiB of memory, "), 0u) << text;
  EXPECT_NE(text.find("\n  task t : rod {\n       ^\nhelp: fewer cells"), std::string::npos) << text;
}

/// The interpreter runs every pass.
TEST(RepeatedScene, CostsItsCertificateAllPasses) {
  const auto seconds = [](int count) { return analysis::expected_seconds(*compiled_task(quadratic, count)); };
  const double few = seconds(1000), many = seconds(1'000'000);
  EXPECT_NEAR(many / few, 1000, 100);
}

TEST(RepeatedScene, IsCertified) {
  expect_certified(task_of(quadratic, 5), true);
  expect_certified(task_of(linear, 6), true);
}

/// From u = 1: 1, 1, 2 are saved and u becomes 4. Last first: w = 2*2, 10*4 + 1*1, 10*41.
const std::string loading =
    "kernel up(u: field, out v: field, k: param) { v = u + k }\n"
    "kernel join(w: field halo 1, q: field, out r: field, n, c: param) { r = 10*w + n*q + 0*c*w[-1] }\n"
    "program step {\n  axes x bounded\n  repeat k in 0 .. 3 { save u in s; run up; swap u, v } to u_2\n"
    "  repeat n in 3 .. 0 { load q from s; fill w x = 0.1*n + c; run join; swap w, r } to w_2\n"
    "  swap u, u_2\n  swap w, w_2\n}\n";

/// A loaded value has its own name, which needs no input value.
TEST(RepeatedScene, LoadsUnderAName) {
  const std::string text = loading +
                           "scene s : step { grid x = 0 .. 1, cells 2; c = 2; initial u = 1; initial w = 0; time 0 .. "
                           "1, step 1 }\ntask t : s { unknown initial u; unknown initial w; minimise mean(w^2 + u) }\n";
  const SceneResult result = run_scene(text.substr(0, text.find("task")), "s");
  ASSERT_FALSE(result.state.empty());
  EXPECT_EQ(result.state.at("u"), (std::vector<double>{4, 4}));
  EXPECT_EQ(result.state.at("w"), (std::vector<double>{410, 410}));
  expect_certified(text, true);
}

}  // namespace
}  // namespace dpde::testing
