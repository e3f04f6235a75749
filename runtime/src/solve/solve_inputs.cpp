// SPDX-License-Identifier: Apache-2.0
#include "solve/solve_inputs.h"

#include <algorithm>
#include <array>
#include <utility>

#include "real.h"
#include "solve/vector_parts.h"

namespace dpde {
namespace {

/// f(element of a field, number of the cell) of the first cell of each row.
template <class F>
void for_each_row(const dpde_layout& layout, const Team& team, const F& f) {
  const std::int64_t rows = layout.cells[1] * layout.cells[2], parts = std::min(rows, VectorParts::most);
  const auto some = [&](std::int64_t part, int = 0) {
    for (std::int64_t row = rows * part / parts; row < rows * (part + 1) / parts; ++row)
      f(row % layout.cells[1] * layout.stride[1] + row / layout.cells[1] * layout.stride[2], row * layout.cells[0]);
  };
  if (cells_of(layout) >= VectorParts::least_shared) return team.run(parts, some);
  for (std::int64_t part = 0; part < parts; ++part) some(part);
}

}  // namespace

dpde_layout with_three_axes(dpde_layout layout) {
  for (int axis = layout.rank; axis < 3; ++axis) layout.cells[axis] = 1;
  return layout;
}

double rounding_of(const dpde_layout& layout) { return layout.real == DPDE_F32 ? 0x1p-23 : 0x1p-52; }

std::size_t cells_of(const dpde_layout& layout) {
  return static_cast<std::size_t>(layout.cells[0] * layout.cells[1] * layout.cells[2]);
}

std::array<bool, 3> periodic_axes(const dpde_solve& solve, const dpde_layout& layout) {
  std::array<bool, 3> periodic{};
  for (int32_t i = 0; i < solve.operation_count; ++i) {
    const dpde_operation& operation = solve.operations[i];
    const auto note = [&](const dpde_fill& fill) {
      for (size_t axis = 0; axis < 3; ++axis)
        periodic[axis] = static_cast<int32_t>(axis) < layout.rank && fill.axes[axis].low.rule == nullptr;
    };
    if (operation.kind == DPDE_FILL || operation.kind == DPDE_FOLD) note(operation.fill);
    for (int32_t k = 0; operation.kind == DPDE_SWEEP && k < operation.then_count; ++k) note(operation.then[k]);
  }
  return periodic;
}

void read_cells(const dpde_layout& layout, const void* base, std::span<double> values, const Team& team) {
  with_real(layout.real, [&](auto real) {
    const auto* const cells = static_cast<const decltype(real)*>(base);
    for_each_row(layout, team, [&](std::int64_t at, std::int64_t first) {
      std::copy_n(cells + at, layout.cells[0], values.begin() + first);
    });
  });
}

void write_cells(const dpde_layout& layout, void* base, std::span<const double> values, const Team& team) {
  with_real(layout.real, [&](auto real) {
    using Real = decltype(real);
    auto* const cells = static_cast<Real*>(base);
    for_each_row(layout, team, [&](std::int64_t at, std::int64_t first) {
      const double* const from = values.data() + first;
      if constexpr (std::is_same_v<Real, double>) {
        std::copy_n(from, layout.cells[0], cells + at);
      } else {
        for (std::int64_t x = 0; x < layout.cells[0]; ++x) cells[at + x] = static_cast<Real>(from[x]);
      }
    });
  });
}

SolveInputs::SolveInputs(const dpde_solve& solve, const dpde_layout& layout)
    : solve_(solve),
      layout_(with_three_axes(layout)),
      coefficients_(static_cast<std::size_t>(solve.coefficient_count)),
      params_(static_cast<std::size_t>(solve.param_count), 0.0) {
  for (std::vector<double>& values : coefficients_) values.assign(cells_of(layout_), 0.0);
  values_.assign(cells_of(layout_), 0.0);
}

bool SolveInputs::have_changed(void* const* fields, const double* params) {
  bool changed = std::exchange(is_new_, false);
  for (std::size_t i = 0; i < params_.size(); ++i) {
    const double now = params[solve_.params[i]];
    changed = changed || now != params_[i];
    params_[i] = now;
  }
  for (std::size_t i = 0; i < coefficients_.size(); ++i) {
    read_cells(layout_, fields[solve_.coefficients[i]], values_);
    if (values_ == coefficients_[i]) continue;
    changed = true;
    std::swap(values_, coefficients_[i]);
  }
  return changed;
}

}  // namespace dpde
