// SPDX-License-Identifier: Apache-2.0
// JIT and compiled C++, run by the runtime's executor, against the reference interpreter: every program of
// program_cases and its derivatives, on every small extent, twice in a row (a swap's halo must be filled for the next
// step), in both precisions. Floats may differ by their rounding, which the interpreter has at stores only.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "adjoint/reverse/newton_steps.h"
#include "codegen/cpp/compile_cpp.h"
#include "codegen/llvm/jit.h"
#include "loop/from_stencil.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"
#include "stencil/build.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"
#include "support/program_run.h"
#include "support/setting.h"

namespace dpde {
namespace {

using stencil::Grid;
using testing::Outcome;

constexpr int steps = 2;

void expect_close(const Outcome& got, const Outcome& wanted, double tolerance) {
  ASSERT_EQ(got.fields.size(), wanted.fields.size());
  for (const auto& [field, values] : wanted.fields) {
    for (size_t i = 0; i < values.size(); ++i) {
      EXPECT_NEAR(got.fields.at(field)[i], values[i], tolerance * (1 + std::abs(values[i]))) << field << " at " << i;
      if (::testing::Test::HasFailure()) return;
    }
  }
  for (const auto& [sum, value] : wanted.sums) {
    EXPECT_NEAR(got.sums.at(sum), value, tolerance * (1 + std::abs(value))) << sum;
  }
}

/// A module with program `name`, its tangent, its adjoint and the adjoint of that.
struct Variants {
  stencil::Module module;
  std::vector<std::string> programs;
};

Variants variants_of(const testing::ProgramCase& c) {
  Variants variants{testing::parse_module(c.text), {"p"}};
  const auto add = [&](const adjoint::Derivative& derived) {
    for (const auto& kernel : derived.module.kernels) {
      if (!variants.module.find_kernel(kernel.name)) variants.module.kernels.push_back(kernel);
    }
    variants.module.programs.push_back(*derived.module.find_program(derived.program));
    variants.programs.push_back(derived.program);
  };
  DiagnosticSink sink;
  add(adjoint::tangent(variants.module, "p", c.wrt, sink));
  const stencil::Module primal = variants.module;
  add(adjoint::adjoint(primal, "p", c.wrt, sink));
  EXPECT_FALSE(sink.has_errors());
  const adjoint::Derivative twice = adjoint::adjoint(variants.module, "p_adjoint", c.wrt, sink);
  const bool is_refused = c.name == "values along walls, interpolated" || c.name.starts_with("weights that vary");
  EXPECT_EQ(sink.has_errors(), is_refused) << c.name;
  if (!sink.has_errors()) add(twice);
  return variants;
}

using Compile = std::function<std::shared_ptr<codegen::CompiledModule>(const loop::Module&)>;

void expect_same_results(const testing::ProgramCase& c, Precision real, const Compile& compile) {
  const Variants variants = variants_of(c);
  const loop::Module loops = loop::from_stencil(adjoint::with_newton_steps(variants.module), variants.programs, real);
  ASSERT_EQ(loop::verify(loops), std::vector<std::string>{}) << loop::print(loops);
  const auto code = compile(loops);
  ASSERT_TRUE(code);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(0.5, 1.5), small(0.02, 0.08);
  for (const std::string& name : variants.programs) {
    const stencil::Program& program = *variants.module.find_program(name);
    const stencil::Interface needs = stencil::interface_of(variants.module, program);
    for (const Grid& grid : testing::small_grids(c.rank)) {
      const size_t size = static_cast<size_t>(grid.cells[0]) * grid.cells[1] * grid.cells[2];
      testing::RunInputs inputs{grid, {}, {}, steps, real};
      for (const std::string& field : needs.inputs) {
        inputs.fields[field].resize(size);
        for (double& v : inputs.fields[field]) v = value(random);
      }
      for (const stencil::Swap& swap : program.swaps) inputs.fields.try_emplace(swap.state, size, 1.0);
      for (const std::string& p : needs.params) inputs.params[p] = p[0] == 'h' ? value(random) : small(random);
      SCOPED_TRACE(c.name + " " + name + " on " + std::to_string(grid.cells[0]) + " x " +
                   std::to_string(grid.cells[1]) + " x " + std::to_string(grid.cells[2]));
      const Outcome wanted = testing::run_interpreted(variants.module, program, inputs);
      const Outcome one = testing::run_executed(*code->find(name), program, inputs, 1),
                    two = testing::run_executed(*code->find(name), program, inputs, 2);
      expect_close(one, wanted, real == Precision::f64 ? 1e-11 : 1e-5);
      EXPECT_EQ(one.fields, two.fields);
      EXPECT_EQ(one.sums, two.sums);
      if (testing::writes_over_states(*code->find(name))) {
        const Outcome over = testing::run_executed(*code->find(name), program, inputs, 2, true);
        EXPECT_EQ(over.fields, one.fields);
        EXPECT_EQ(over.sums, one.sums);
      }
      if (::testing::Test::HasFailure()) return;
    }
  }
}

void expect_all_agree(Precision real, const Compile& compile, std::size_t every = 1) {
  const std::vector<testing::ProgramCase> cases = testing::program_cases();
  for (std::size_t i = 0; i < cases.size(); i += every) {
    expect_same_results(cases[i], real, compile);
    if (::testing::Test::HasFailure()) return;
  }
}

std::shared_ptr<codegen::CompiledModule> by_jit(const loop::Module& module) {
  codegen::JitResult result = codegen::jit(module);
  EXPECT_EQ(result.error, "");
  return result.module;
}

std::shared_ptr<codegen::CompiledModule> by_cpp(const loop::Module& module) {
  codegen::CompileResult result = codegen::compile_cpp(module);
  EXPECT_EQ(result.error, "");
  return result.module;
}

TEST(BackEnds, JitAgreesWithTheInterpreter) {
  expect_all_agree(Precision::f64, by_jit, testing::is_thorough() ? 1 : 5);
}
TEST(BackEnds, JitAgreesWithTheInterpreterInSinglePrecision) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  expect_all_agree(Precision::f32, by_jit, testing::is_thorough() ? 1 : 6);
}
/// A compiler takes a second for each; the random programs are compiled by it too.
TEST(BackEnds, CompiledCppAgreesWithTheInterpreter) {
  expect_all_agree(Precision::f64, by_cpp, testing::is_thorough() ? 1 : 30);
}
TEST(BackEnds, CompiledCppAgreesWithTheInterpreterInSinglePrecision) {
  expect_all_agree(Precision::f32, by_cpp, testing::is_thorough() ? 1 : 36);
}

}  // namespace
}  // namespace dpde
