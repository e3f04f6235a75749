// SPDX-License-Identifier: Apache-2.0
// JIT and compiled C++, run by the runtime's executor, against the reference interpreter: every program of
// program_cases and its derivatives, on every small extent, twice in a row (a swap's halo must be filled for the next step).
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "codegen/cpp/compile_cpp.h"
#include "codegen/llvm/jit.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "loop/from_stencil.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"
#include "stencil/build.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"

namespace dpde {
namespace {

using stencil::Grid;

struct Outcome {
  std::map<std::string, std::vector<double>> fields;
  std::map<std::string, double> sums;
};
using Fields = std::map<std::string, std::vector<double>>;

constexpr int steps = 2;

Outcome by_interpreter(const stencil::Module& module, const stencil::Program& program, const Grid& grid, const Fields& inputs,
                       const stencil::Params& params) {
  int halo = 1;
  for (const auto& [field, widths] : stencil::required_halo(module, program)) {
    for (const int w : widths) halo = std::max(halo, w);
  }
  stencil::State state(grid, halo);
  for (const auto& [field, values] : inputs) state.set(field, values);
  for (int axis = 0; axis < grid.rank; ++axis) state.set_coordinate(axis, program.axes[axis], 0, 0.3);
  Outcome outcome;
  for (int n = 0; n < steps; ++n) outcome.sums = stencil::interpret(module, program, state, params);
  for (const stencil::Swap& swap : program.swaps) outcome.fields[swap.state] = state.get(swap.state);
  for (const std::string& keep : program.keeps) outcome.fields[keep] = state.get(keep);
  return outcome;
}

Outcome by_executor(const dpde_program& program, const stencil::Program& text, const Grid& grid, const Fields& inputs,
                    const stencil::Params& params, int threads) {
  const std::vector<int64_t> cells(grid.cells.begin(), grid.cells.begin() + grid.rank);
  const dpde_layout layout = make_layout(cells, {program.halo[0], program.halo[1], program.halo[2]});
  Executor executor(program, layout, threads);
  std::vector<Field> memory;
  std::map<std::string, int> index;
  for (int i = 0; i < program.field_count; ++i) {
    memory.emplace_back(layout, i);
    memory.back().fill(std::nan(""));
    index[program.fields[i]] = i;
  }
  for (const auto& [field, values] : inputs) {
    if (index.contains(field)) memory[index.at(field)].copy_in(values);
  }
  for (int axis = 0; axis < grid.rank; ++axis) {
    const auto coordinate = index.find(std::string(1, "xyz"[axis]));
    const bool periodic = text.axes[axis] == Topology::periodic;
    if (coordinate != index.end()) fill_coordinate(memory[coordinate->second], axis, 0, 0.3, periodic);
  }
  for (int i = 0; i < program.field_count; ++i) executor.bind(i, memory[i].base());
  for (const auto& [name, value] : params) {
    if (executor.param_index(name) >= 0) executor.set_param(executor.param_index(name), value);
  }
  executor.update_uniforms();
  executor.prepare();
  for (int n = 0; n < steps; ++n) {
    executor.run();
    for (const stencil::Swap& swap : text.swaps) {
      const int a = executor.field_index(swap.state), b = executor.field_index(swap.next);
      double* base = executor.bound(a);
      executor.bind(a, executor.bound(b));
      executor.bind(b, base);
    }
  }
  Outcome outcome;
  const size_t size = static_cast<size_t>(cell_count(layout));
  const auto take = [&](const std::string& field) {
    std::vector<double>& values = outcome.fields[field];
    values.resize(size);
    copy_out(layout, executor.bound(executor.field_index(field)), values);
  };
  for (const stencil::Swap& swap : text.swaps) take(swap.state);
  for (const std::string& keep : text.keeps) take(keep);
  for (int i = 0; i < program.sum_count; ++i) outcome.sums[program.sums[i]] = executor.sums()[i];
  return outcome;
}

void expect_close(const Outcome& got, const Outcome& wanted) {
  ASSERT_EQ(got.fields.size(), wanted.fields.size());
  for (const auto& [field, values] : wanted.fields) {
    for (size_t i = 0; i < values.size(); ++i) {
      EXPECT_NEAR(got.fields.at(field)[i], values[i], 1e-11 * (1 + std::abs(values[i]))) << field << " at " << i;
      if (::testing::Test::HasFailure()) return;
    }
  }
  for (const auto& [sum, value] : wanted.sums) {
    EXPECT_NEAR(got.sums.at(sum), value, 1e-11 * (1 + std::abs(value))) << sum;
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
  EXPECT_EQ(sink.has_errors(), c.name == "values along walls, interpolated");  // which is refused
  if (!sink.has_errors()) add(twice);
  return variants;
}

void expect_same_results(const testing::ProgramCase& c, const std::function<std::shared_ptr<codegen::CompiledModule>(const loop::Module&)>& compile) {
  const Variants variants = variants_of(c);
  const loop::Module loops = loop::from_stencil(variants.module, variants.programs);
  ASSERT_EQ(loop::verify(loops), std::vector<std::string>{}) << loop::print(loops);
  const auto code = compile(loops);
  ASSERT_TRUE(code);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(0.5, 1.5), small(0.02, 0.08);
  for (const std::string& name : variants.programs) {
    const stencil::Program& program = *variants.module.find_program(name);
    const stencil::Interface needs = stencil::interface_of(variants.module, program);
    for (const Grid& grid : testing::small_grids(c.rank)) {
      Fields inputs;
      for (const std::string& field : needs.inputs) {
        inputs[field].resize(static_cast<size_t>(grid.cells[0]) * grid.cells[1] * grid.cells[2]);
        for (double& v : inputs[field]) v = value(random);
      }
      for (const stencil::Swap& swap : program.swaps) {
        if (!inputs.contains(swap.state)) inputs[swap.state].assign(static_cast<size_t>(grid.cells[0]) * grid.cells[1] * grid.cells[2], 1.0);
      }
      stencil::Params params;
      for (const std::string& p : needs.params) params[p] = p[0] == 'h' ? value(random) : small(random);
      SCOPED_TRACE(c.name + " " + name + " on " + std::to_string(grid.cells[0]) + " x " + std::to_string(grid.cells[1]) + " x " +
                   std::to_string(grid.cells[2]));
      const Outcome wanted = by_interpreter(variants.module, program, grid, inputs, params);
      for (const int threads : {1, 2}) expect_close(by_executor(*code->find(name), program, grid, inputs, params, threads), wanted);
      if (::testing::Test::HasFailure()) return;
    }
  }
}

TEST(BackEnds, JitAgreesWithTheInterpreter) {
  for (const auto& c : testing::program_cases()) {
    expect_same_results(c, [](const loop::Module& module) {
      codegen::JitResult result = codegen::jit(module);
      EXPECT_EQ(result.error, "");
      return result.module;
    });
    if (HasFailure()) return;
  }
}

TEST(BackEnds, CompiledCppAgreesWithTheInterpreter) {
  for (const auto& c : testing::program_cases()) {
    expect_same_results(c, [](const loop::Module& module) {
      codegen::CompileResult result = codegen::compile_cpp(module);
      EXPECT_EQ(result.error, "");
      return result.module;
    });
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace dpde
