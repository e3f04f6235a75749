// SPDX-License-Identifier: Apache-2.0
// Variants of rows (narrower vectors, stores past the caches) give the values of the rows themselves to the last bit:
// else results would depend on which of them is found to be fastest.
#include <gtest/gtest.h>

#include <random>

#include "adjoint/reverse/newton_steps.h"
#include "codegen/llvm/emit_llvm.h"
#include "codegen/llvm/jit.h"
#include "loop/from_stencil.h"
#include "stencil/build.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"
#include "support/program_run.h"
#include "support/setting.h"

namespace dpde {
namespace {

/// The program with variant v in place of each row that may take it; `count` of rows that were replaced.
struct Changed {
  Changed(const dpde_program& from, int v) : program(from), kernels(from.kernels, from.kernels + from.kernel_count) {
    for (int i = 0; i < from.operation_count; ++i) {
      const dpde_operation& operation = from.operations[i];
      if (operation.kind != DPDE_SWEEP) continue;
      dpde_kernel& kernel = kernels[static_cast<size_t>(operation.kernel)];
      if (v >= kernel.variant_count || (kernel.variants[v].streams != 0 && operation.grow[0] != 0)) continue;
      kernel.row = kernel.variants[v].row;
      ++count;
    }
    program.kernels = kernels.data();
  }
  dpde_program program;
  std::vector<dpde_kernel> kernels;
  int count = 0;
};

testing::RunInputs inputs_of(const stencil::Module& module, const stencil::Program& program,
                             const testing::ProgramCase& c, Precision real) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(0.5, 1.5), small(0.02, 0.08);
  const stencil::Grid grid{c.rank, {67, c.rank > 1 ? 5 : 1, c.rank > 2 ? 3 : 1}};  // whole vectors and a rest
  testing::RunInputs inputs{grid, {}, {}, 2, real};
  const stencil::Interface needs = stencil::interface_of(module, program);
  const auto size = static_cast<size_t>(grid.cells[0] * grid.cells[1] * grid.cells[2]);
  for (const std::string& field : needs.inputs) {
    inputs.fields[field].resize(size);
    for (double& v : inputs.fields[field]) v = value(random);
  }
  for (const stencil::Swap& swap : program.swaps) inputs.fields.try_emplace(swap.state, size, 1.0);
  for (const std::string& p : needs.params) inputs.params[p] = p[0] == 'h' ? value(random) : small(random);
  return inputs;
}

/// How many rows were replaced.
int expect_same_values(const testing::ProgramCase& c, Precision real) {
  SCOPED_TRACE(c.name);
  stencil::Module module = testing::parse_module(c.text);
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", c.wrt, sink);
  EXPECT_FALSE(sink.has_errors());
  for (const auto& kernel : derived.module.kernels) {
    if (!module.find_kernel(kernel.name)) module.kernels.push_back(kernel);
  }
  module.programs.push_back(*derived.module.find_program(derived.program));
  const loop::Module loops = loop::from_stencil(adjoint::with_newton_steps(module), {"p", derived.program}, real);
  const codegen::JitResult code = codegen::jit(loops, {.variants = true}),
                           quick = codegen::jit(loops, {.effort = codegen::Effort::quick});
  EXPECT_EQ(code.error, "");
  EXPECT_EQ(quick.error, "");
  int count = 0;
  for (const std::string& name : {std::string("p"), derived.program}) {
    const stencil::Program& program = *module.find_program(name);
    const testing::RunInputs inputs = inputs_of(module, program, c, real);
    const testing::Outcome wanted = testing::run_executed(*code.module->find(name), program, inputs, 1);
    for (const int v : {0, 1, 2}) {  // streamed, fetched early, narrow: the last does not shift whole lines
      const Changed changed(*code.module->find(name), v);
      count += changed.count;
      const testing::Outcome got = testing::run_executed(changed.program, program, inputs, 1);
      EXPECT_EQ(got.fields, wanted.fields) << name << " with variant " << v;
      EXPECT_EQ(got.sums, wanted.sums) << name << " with variant " << v;
    }
    const testing::Outcome got = testing::run_executed(*quick.module->find(name), program, inputs, 1);
    EXPECT_EQ(got.fields, wanted.fields) << name << ", compiled quickly";
    EXPECT_EQ(got.sums, wanted.sums) << name << ", compiled quickly";
  }
  return count;
}

TEST(Variants, GiveTheValuesOfTheRow) {
  int count = 0;
  for (const auto& c : testing::cases_by_day(0, 3)) count += expect_same_values(c, Precision::f64);
  EXPECT_GT(count, 13);
}

TEST(Variants, GiveTheValuesOfTheRowInSinglePrecision) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  for (const auto& c : testing::cases_by_day(1, 3)) expect_same_values(c, Precision::f32);
}

TEST(Variants, StreamPastTheCaches) {
  const stencil::Module module = testing::parse_module(
      "kernel k(u: field halo 1, out v: field) { v = u[-1] + u[+1] }\nprogram p { fill u periodic; run k; keep v }");
  const loop::Module loops = loop::from_stencil(module, {"p"}, Precision::f64);
  EXPECT_EQ(codegen::emit_assembly(loops, {}).find("movnt"), std::string::npos);
  EXPECT_NE(codegen::emit_assembly(loops, {.variants = true}).find("movntp"), std::string::npos);
}

}  // namespace
}  // namespace dpde
