// SPDX-License-Identifier: Apache-2.0
#include "support/program_run.h"

#include <algorithm>
#include <cmath>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "stencil/build.h"

namespace dpde::testing {

using namespace stencil;

Outcome run_interpreted(const Module& module, const Program& program, const RunInputs& inputs) {
  int halo = 1;
  for (const auto& [field, widths] : required_halo(module, program))
    halo = std::max(halo, *std::ranges::max_element(widths));
  State state(inputs.grid, halo, inputs.real);
  for (const auto& [field, values] : inputs.fields) state.set(field, values);
  for (int axis = 0; axis < inputs.grid.rank; ++axis) state.set_coordinate(axis, program.axes[axis], 0, 0.3);
  Outcome outcome;
  for (int n = 0; n < inputs.steps; ++n) outcome.sums = interpret(module, program, state, inputs.params);
  for (const Swap& swap : program.swaps) outcome.fields[swap.state] = state.get(swap.state);
  for (const std::string& keep : program.keeps) outcome.fields[keep] = state.get(keep);
  return outcome;
}

Outcome run_executed(const dpde_program& compiled, const Program& program, const RunInputs& inputs, int threads) {
  const std::vector<int64_t> cells(inputs.grid.cells.begin(), inputs.grid.cells.begin() + inputs.grid.rank);
  const dpde_layout layout = make_layout(cells, {compiled.halo[0], compiled.halo[1], compiled.halo[2]}, compiled.real);
  Executor executor(compiled, layout, threads);
  std::vector<Field> memory;
  for (int i = 0; i < compiled.field_count; ++i) {
    memory.emplace_back(layout, i).fill(std::nan(""));
    const std::string name = compiled.fields[i];
    if (inputs.fields.contains(name)) memory.back().copy_in(inputs.fields.at(name));
    const std::size_t axis = name.size() == 1 ? std::string("xyz").find(name) : std::string::npos;
    if (axis < cells.size())
      fill_coordinate(memory.back(), static_cast<int>(axis), 0, 0.3, program.axes[axis] == Topology::periodic);
  }
  for (int i = 0; i < compiled.field_count; ++i) executor.bind(i, memory[i].base());
  for (const auto& [name, value] : inputs.params) {
    if (executor.param_index(name) >= 0) executor.set_param(executor.param_index(name), value);
  }
  executor.update_uniforms();
  executor.prepare();
  for (int n = 0; n < inputs.steps; ++n) {
    executor.run();
    for (const Swap& swap : program.swaps) {
      const int a = executor.field_index(swap.state), b = executor.field_index(swap.next);
      void* base = executor.bound(a);
      executor.bind(a, executor.bound(b));
      executor.bind(b, base);
    }
  }
  Outcome outcome;
  const auto take = [&](const std::string& field) {
    std::vector<double>& values = outcome.fields[field];
    values.resize(static_cast<std::size_t>(cell_count(layout)));
    copy_out(layout, executor.bound(executor.field_index(field)), values);
  };
  for (const Swap& swap : program.swaps) take(swap.state);
  for (const std::string& keep : program.keeps) take(keep);
  for (int i = 0; i < compiled.sum_count; ++i) outcome.sums[compiled.sums[i]] = executor.sums()[i];
  return outcome;
}

}  // namespace dpde::testing
