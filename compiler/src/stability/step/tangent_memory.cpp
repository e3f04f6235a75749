// SPDX-License-Identifier: Apache-2.0
#include "stability/step/tangent_memory.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include "dpde/runtime/unsolved.h"

namespace dpde::stability {

namespace {

/// Copies all cells, with the halo.
void copy_all_cells(const stencil::State& from, const std::string& name, Field& to) {
  stencil::CellIndex low{}, high = from.grid().cells;
  for (std::size_t axis = 0; axis < low.size(); ++axis) {
    const int halo = std::min(from.halo(static_cast<int>(axis)), static_cast<int>(to.layout().halo[axis]));
    low[axis] -= halo;
    high[axis] += halo;
  }
  stencil::for_each_cell(
      low, high, [&](const stencil::CellIndex& cell) { to.set(from.at(name, cell), cell[0], cell[1], cell[2]); });
}

dpde_layout layout_of(const CompiledTangent& tangent, const stencil::Grid& grid) {
  const std::vector<std::int64_t> counts(grid.cells.begin(), grid.cells.begin() + grid.rank);
  std::array<std::int64_t, 3> halo{};
  for (const dpde_program* program : {&tangent.step(), tangent.fixed()}) {
    for (std::size_t axis = 0; program != nullptr && axis < halo.size(); ++axis)
      halo[axis] = std::max<std::int64_t>(halo[axis], program->halo[axis]);
  }
  return make_layout(counts, halo, tangent.step().real);
}

void set_params(Executor& executor, const stencil::Params& params) {
  for (const auto& [name, value] : params) {
    if (const int index = executor.param_index(name); index >= 0) executor.set_param(index, value);
  }
  executor.update_uniforms();
}

}  // namespace

TangentMemory::TangentMemory(const CompiledTangent& tangent, const stencil::State& inputs)
    : layout_(layout_of(tangent, inputs.grid())),
      solvers_(make_solver_store()),
      executor_(tangent.step(), layout_, 1, solvers_) {
  if (const dpde_program* fixed = tangent.fixed()) fixed_.emplace(*fixed, layout_, 1, solvers_);
  const dpde_program& program = executor_.program();
  for (int i = 0; i < program.field_count; ++i) {
    fields_.push_back(new_field(program.fields[i], inputs, i));
    if (!inputs.has(program.fields[i]) && !(fixed_ && fixed_->field_index(program.fields[i]) >= 0))
      scratch_.push_back(i);
  }
  if (fixed_) bind_fixed(inputs);
}

Field TangentMemory::new_field(const char* name, const stencil::State& inputs, int number) const {
  Field field(layout_, number);
  if (inputs.has(name)) copy_all_cells(inputs, name, field);
  return field;
}

void TangentMemory::bind_fixed(const stencil::State& inputs) {
  const dpde_program& program = fixed_->program();
  for (int i = 0; i < program.field_count; ++i) {
    const int own = executor_.field_index(program.fields[i]);
    fixed_->bind(i,
                 own >= 0 ? field(own).base() : others_.emplace_back(new_field(program.fields[i], inputs, i)).base());
  }
}

void TangentMemory::begin(const stencil::Params& params) {
  for (int i = 0; i < executor_.program().field_count; ++i) executor_.bind(i, field(i).base());
  if (params_) {  // else all fields are still 0
    for (const int i : scratch_) field(i).fill(0);
  }
  if (params_ != params) {
    set_params(executor_, params);
    if (fixed_) {
      set_params(*fixed_, params);
      fixed_->prepare();
      fixed_->run();
    }
    params_ = params;
  }
  executor_.prepare();
}

bool TangentMemory::advance(int steps, const std::vector<std::pair<int, int>>& states) try {
  for (int i = 0; i < steps; ++i) {
    executor_.prepare();
    executor_.run();
    for (const auto& [before, behind] : states) {
      void* const base = executor_.bound(before);
      executor_.bind(before, executor_.bound(behind));
      executor_.bind(behind, base);
    }
  }
  return true;
} catch (const Unsolved& error) {  // the scene's run fails, too, and reports the model's unknown and its position
  const std::string& reason = error.facts().reason;
  unsolved_ = reason.empty() ? error.what() : reason;
  return false;
}

}  // namespace dpde::stability
