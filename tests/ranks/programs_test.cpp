// SPDX-License-Identifier: Apache-2.0
// Programs with every kind of node, boundary and statement, their tangents and adjoints, on grids that are divided
// among ranks: fields are those of the whole grid to the last bit, but where values of several ranks are added up for
// them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "adjoint/reverse/newton_steps.h"
#include "codegen/llvm/jit.h"
#include "dpde/runtime/error.h"
#include "loop/from_stencil.h"
#include "stencil/build.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"
#include "support/program_run.h"
#include "support/split_mix.h"

namespace dpde::testing {
namespace {

struct Shape {
  std::array<int, 3> cells;
  std::vector<std::array<int64_t, 3>> ranks;
};
const Shape shapes[] = {{{77, 1, 1}, {{2, 1, 1}, {3, 1, 1}}},
                        {{70, 19, 1}, {{2, 1, 1}, {1, 2, 1}, {2, 2, 1}}},
                        {{37, 12, 13}, {{1, 1, 2}, {2, 2, 1}}}};

/// The program, its tangent and its adjoint, those that there are.
stencil::Module derived(const ProgramCase& c, std::vector<std::string>& programs) {
  stencil::Module module = parse_module(c.text);
  programs = {"p"};
  DiagnosticSink sink;
  for (const adjoint::Derivative& derivative :
       {adjoint::tangent(module, "p", c.wrt, sink), adjoint::adjoint(module, "p", c.wrt, sink)}) {
    for (const stencil::Kernel& kernel : derivative.module.kernels) {
      if (module.find_kernel(kernel.name) == nullptr) module.kernels.push_back(kernel);
    }
    module.programs.push_back(*derivative.module.find_program(derivative.program));
    programs.push_back(derivative.program);
  }
  return adjoint::with_newton_steps(module);
}

RunInputs random_inputs(const stencil::Module& module, const stencil::Program& program, const ProgramCase& c) {
  RunInputs inputs;
  inputs.grid.rank = c.rank;
  inputs.grid.cells = shapes[c.rank - 1].cells;
  inputs.steps = 2;
  const std::size_t size = static_cast<std::size_t>(inputs.grid.cells[0]) * inputs.grid.cells[1] * inputs.grid.cells[2];
  SplitMix random(7);
  const stencil::Interface needs = stencil::interface_of(module, program);
  for (const std::string& field : needs.inputs) {
    if (field != "x" && field != "y" && field != "z") inputs.fields[field] = random.uniform(size, 0.5, 1.5);
  }
  for (const stencil::Swap& swap : program.swaps) inputs.fields.try_emplace(swap.state, size, 1.0);
  for (const std::string& p : needs.params)
    inputs.params[p] = p[0] == 'h' ? random.uniform(0.8, 1.2) : random.uniform(0.02, 0.08);
  return inputs;
}

void expect_near(const Outcome& divided, const Outcome& whole, double of_fields) {
  const auto expect = [](double a, double b, double tolerance, const std::string& name) {
    if (std::isfinite(b)) EXPECT_LE(std::abs(a - b), tolerance * std::max(1.0, std::abs(b))) << name;
  };
  for (const auto& [field, values] : whole.fields) {
    for (std::size_t i = 0; i < values.size(); ++i) expect(divided.fields.at(field)[i], values[i], of_fields, field);
  }
  for (const auto& [sum, value] : whole.sums) expect(divided.sums.at(sum), value, 1e-11, sum);
}

TEST(DividedPrograms, AreWhatTheyAreOnTheWholeGrid) {
  int runs = 0, refused = 0;
  for (const ProgramCase& c : cases_by_day(1, 10)) {
    std::vector<std::string> names;
    const stencil::Module module = derived(c, names);
    const codegen::JitResult code = codegen::jit(loop::from_stencil(module, names));
    ASSERT_EQ(code.error, "");
    for (const std::string& name : names) {
      const stencil::Program& program = *module.find_program(name);
      const dpde_program& table = *code.module->find(name);
      const RunInputs inputs = random_inputs(module, program, c);
      std::optional<Outcome> whole;
      for (const auto& ranks : shapes[c.rank - 1].ranks) {
        SCOPED_TRACE(fmt::format("{}: {} on {} ranks", c.name, name, fmt::join(ranks, " x ")));
        try {
          const Outcome divided = run_divided(table, program, inputs, ranks);
          if (!whole) whole = run_executed(table, program, inputs, 1);
          expect_near(divided, *whole, adds_up_fields(table) ? 1e-11 : 0);
          ++runs;
        } catch (const Error& error) {
          EXPECT_NE(std::string(error.what()).find("divided among"), std::string::npos) << error.what();
          ++refused;
        }
      }
      if (HasFailure()) return;
    }
  }
  EXPECT_GT(runs, 2 * refused);
}

}  // namespace
}  // namespace dpde::testing
