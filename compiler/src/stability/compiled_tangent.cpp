// SPDX-License-Identifier: Apache-2.0
#include "stability/compiled_tangent.h"

#include <algorithm>

#include "codegen/llvm/jit.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "driver/pipeline.h"
#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stability {

namespace {

bool is_of_kernels(const std::vector<stencil::Statement>& body) {
  return std::ranges::all_of(body, [](const stencil::Statement& statement) {
    return match(
        statement, [](const stencil::Fill&) { return true; }, [](const stencil::Fold&) { return false; },
        [](const stencil::Reduce&) { return false; }, [](const stencil::NetworkCall&) { return false; },
        [](const stencil::Transform&) { return false; }, [](const stencil::Run&) { return true; },
        [](const stencil::Solve&) { return false; }, [](const stencil::Repeat&) { return false; });
  });
}

/// Halo included.
void copy_all_cells(const stencil::State& from, const std::string& name, Field& to) {
  stencil::Cell low{}, high = from.grid().cells;
  for (std::size_t axis = 0; axis < low.size(); ++axis) {
    const int halo = std::min(from.halo(static_cast<int>(axis)), static_cast<int>(to.layout().halo[axis]));
    low[axis] -= halo;
    high[axis] += halo;
  }
  stencil::for_each_cell(low, high,
                         [&](const stencil::Cell& cell) { to.set(from.at(name, cell), cell[0], cell[1], cell[2]); });
}

}  // namespace

stencil::State memory_for(const LinearStep& linear, const stencil::Grid& grid) {
  int halo = 0;
  for (const auto& [field, widths] : stencil::required_halo(linear.module(), linear.program()))
    halo = std::max(halo, *std::ranges::max_element(widths));
  return {grid, halo};
}

stencil::Grid grid_of(const std::vector<model::Axis>& axes) {
  stencil::Grid grid;
  grid.rank = static_cast<int>(axes.size());
  for (std::size_t a = 0; a < axes.size(); ++a) grid.cells[a] = axes[a].cells;
  return grid;
}

std::unique_ptr<CompiledTangent> CompiledTangent::make(const LinearStep& linear) {
  if (!is_of_kernels(linear.program().body)) return nullptr;
  auto code = codegen::jit(driver::lower_to_loop(linear.module(), {linear.program().name}, Precision::f64)).module;
  if (code == nullptr || code->find(linear.program().name) == nullptr) return nullptr;
  return std::unique_ptr<CompiledTangent>(new CompiledTangent(linear, std::move(code)));
}

Eigen::MatrixXd CompiledTangent::matrix(const stencil::State& inputs, const stencil::Params& params) const {
  const dpde_program& program = *code_->find(linear_.program().name);
  const stencil::Grid& grid = inputs.grid();
  const std::vector<std::int64_t> counts(grid.cells.begin(), grid.cells.begin() + grid.rank);
  const dpde_layout layout = make_layout(counts, {program.halo[0], program.halo[1], program.halo[2]}, program.real);
  Executor executor(program, layout);
  std::vector<Field> fields;
  for (int i = 0; i < program.field_count; ++i) {
    fields.emplace_back(layout, i).fill(0);
    if (inputs.has(program.fields[i])) copy_all_cells(inputs, program.fields[i], fields.back());
  }
  for (int i = 0; i < program.field_count; ++i) executor.bind(i, fields[static_cast<std::size_t>(i)].base());
  for (const auto& [name, value] : params) {
    if (const int index = executor.param_index(name); index >= 0) executor.set_param(index, value);
  }
  executor.update_uniforms();
  executor.prepare();
  const auto cells = static_cast<Eigen::Index>(cell_count(layout));
  const auto states = static_cast<Eigen::Index>(linear_.states().size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(cells * states, cells * states);
  std::vector<double> values(static_cast<std::size_t>(cells), 0.0);
  const auto set = [&](Eigen::Index state, Eigen::Index cell, double value) {
    const int field = executor.field_index(linear_.perturbation_of(static_cast<std::size_t>(state)));
    if (field < 0) return;
    values[static_cast<std::size_t>(cell)] = value;
    copy_in(layout, executor.bound(field), values);
    executor.prepare(field);
    values[static_cast<std::size_t>(cell)] = 0;
  };
  for (Eigen::Index column = 0; column < result.cols(); ++column) {
    set(column / cells, column % cells, 1);
    executor.run();
    for (Eigen::Index s = 0; s < states; ++s) {
      const int made = executor.field_index(linear_.result_of(static_cast<std::size_t>(s)));
      if (made >= 0) fields[static_cast<std::size_t>(made)].copy_out({&result(s * cells, column), values.size()});
    }
    set(column / cells, column % cells, 0);
  }
  return result;
}

}  // namespace dpde::stability
