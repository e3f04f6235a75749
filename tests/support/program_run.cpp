// SPDX-License-Identifier: Apache-2.0
#include "support/program_run.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/thread_ranks.h"
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

namespace {

/// Copies between an array of the whole grid and the cells of the layout.
template <class F>
void for_each_cell(const dpde_layout& layout, const F& f) {
  std::size_t own = 0;
  for (int64_t z = 0; z < layout.cells[2]; ++z) {
    for (int64_t y = 0; y < layout.cells[1]; ++y) {
      for (int64_t x = 0; x < layout.cells[0]; ++x) {
        const int64_t row = (z + layout.first[2]) * layout.global[1] + y + layout.first[1];
        f(own++, static_cast<std::size_t>(row * layout.global[0] + x + layout.first[0]));
      }
    }
  }
}

std::span<const dpde_swap> swaps_of(const dpde_program& compiled) {
  return {compiled.swaps, static_cast<std::size_t>(compiled.swap_count)};
}

/// Fields of `outcome` must exist, for the whole grid.
void run_on(const dpde_layout& layout, Executor executor, const Program& program, const RunInputs& inputs,
            Outcome& outcome, bool is_over = false) {
  const dpde_program& compiled = executor.program();
  std::vector<Field> memory;
  for (int i = 0; i < compiled.field_count; ++i) {
    memory.emplace_back(layout, i).fill(std::nan(""));
    const std::string name = compiled.fields[i];
    if (inputs.fields.contains(name)) {
      std::vector<double> own(static_cast<std::size_t>(cell_count(layout)));
      for_each_cell(layout, [&](std::size_t to, std::size_t from) { own[to] = inputs.fields.at(name)[from]; });
      memory.back().copy_in(own);
    }
    const std::size_t axis = name.size() == 1 ? std::string("xyz").find(name) : std::string::npos;
    if (axis < program.axes.size())
      fill_coordinate(memory.back(), static_cast<int>(axis), 0, 0.3, program.axes[axis] == Topology::periodic);
  }
  for (int i = 0; i < compiled.field_count; ++i) executor.bind(i, memory[i].base());
  for (const dpde_swap& swap : swaps_of(compiled)) {
    if (is_over && swap.is_over != 0) executor.bind(swap.next, executor.bound(swap.state));
  }
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
  for (auto& [field, values] : outcome.fields) {
    std::vector<double> own(static_cast<std::size_t>(cell_count(layout)));
    copy_out(layout, executor.bound(executor.field_index(field)), own);
    for_each_cell(layout, [&, &to_all = values](std::size_t from, std::size_t to) { to_all[to] = own[from]; });
  }
  if (layout.first[0] + layout.first[1] + layout.first[2] > 0) return;
  for (int i = 0; i < compiled.sum_count; ++i) outcome.sums[compiled.sums[i]] = executor.sums()[i];
}

Outcome empty_outcome(const Program& program, const RunInputs& inputs) {
  Outcome outcome;
  const std::vector<double> nothing(static_cast<std::size_t>(inputs.grid.cells[0]) * inputs.grid.cells[1] *
                                    inputs.grid.cells[2]);
  for (const Swap& swap : program.swaps) outcome.fields[swap.state] = nothing;
  for (const std::string& keep : program.keeps) outcome.fields[keep] = nothing;
  return outcome;
}

bool adds_up(std::span<const dpde_operation> operations) {
  return std::ranges::any_of(operations, [](const dpde_operation& operation) {
    const dpde_repeat& repeat = operation.repeat;
    return operation.kind == DPDE_REDUCE ||
           adds_up({repeat.operations, static_cast<std::size_t>(repeat.operation_count)});
  });
}

}  // namespace

bool writes_over_states(const dpde_program& compiled) {
  return std::ranges::any_of(swaps_of(compiled), [](const dpde_swap& swap) { return swap.is_over != 0; });
}

Outcome run_executed(const dpde_program& compiled, const Program& program, const RunInputs& inputs, int threads,
                     bool is_over) {
  const std::vector<int64_t> cells(inputs.grid.cells.begin(), inputs.grid.cells.begin() + inputs.grid.rank);
  const dpde_layout layout = make_layout(cells, {compiled.halo[0], compiled.halo[1], compiled.halo[2]}, compiled.real);
  Outcome outcome = empty_outcome(program, inputs);
  run_on(layout, Executor(compiled, layout, threads), program, inputs, outcome, is_over);
  return outcome;
}

Outcome run_divided(const dpde_program& compiled, const Program& program, const RunInputs& inputs,
                    const std::array<int64_t, 3>& ranks) {
  const std::vector<int64_t> cells(inputs.grid.cells.begin(), inputs.grid.cells.begin() + inputs.grid.rank);
  Outcome outcome = empty_outcome(program, inputs);
  run_ranks(ranks, [&](Communicator& rank) {
    const dpde_layout layout =
        make_subgrid(cells, ranks, rank.place(), {compiled.halo[0], compiled.halo[1], compiled.halo[2]}, compiled.real);
    run_on(layout, Executor(compiled, layout, 1, nullptr, &rank), program, inputs, outcome);
  });
  return outcome;
}

bool adds_up_fields(const dpde_program& compiled) {
  for (const dpde_kernel& kernel : std::span(compiled.kernels, static_cast<std::size_t>(compiled.kernel_count))) {
    if (std::any_of(kernel.grids, kernel.grids + kernel.grid_count,
                    [](const dpde_grid& grid) { return grid.is_written != 0; }))
      return true;
  }
  return adds_up({compiled.operations, static_cast<std::size_t>(compiled.operation_count)});
}

}  // namespace dpde::testing
