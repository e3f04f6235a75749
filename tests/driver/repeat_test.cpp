// SPDX-License-Identifier: Apache-2.0
// Scenes of programs with repeats: what is compiled does not grow with the count, memory is planned for what passes
// save, and derivatives of both orders are certified.
#include <regex>

#include "codegen/cpp/emit_cpp.h"
#include "driver/storage.h"
#include "driver_support.h"
#include "loop/print_loop.h"

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
    return plan ? plan->field_bytes : 0;
  };
  const std::int64_t four = bytes(quadratic, 4), eight = bytes(quadratic, 8), many = bytes(quadratic, 4008);
  EXPECT_GE(eight - four, 4 * 12 * 8);
  EXPECT_EQ(many - eight, 1000 * (eight - four));
}

TEST(RepeatedScene, IsCertified) {
  expect_certified(task_of(quadratic, 5), true);
  expect_certified(task_of(linear, 6), true);
}

}  // namespace
}  // namespace dpde::testing
