// SPDX-License-Identifier: Apache-2.0
#include "solve/solve_inputs.h"

#include <algorithm>
#include <array>
#include <utility>

#include "real.h"

namespace dpde {

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

void read_cells(const dpde_layout& layout, const void* base, std::span<double> values) {
  with_real(layout.real, [&](auto real) {
    const auto* cells = static_cast<const decltype(real)*>(base);
    auto to = values.begin();
    for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
      for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
        const auto* row = cells + y * layout.stride[1] + z * layout.stride[2];
        to = std::copy_n(row, layout.cells[0], to);
      }
    }
  });
}

void write_cells(const dpde_layout& layout, void* base, std::span<const double> values) {
  with_real(layout.real, [&](auto real) {
    using Real = decltype(real);
    auto* cells = static_cast<Real*>(base);
    const double* from = values.data();
    for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
      for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
        Real* row = cells + y * layout.stride[1] + z * layout.stride[2];
        if constexpr (std::is_same_v<Real, double>) {
          std::copy_n(from, layout.cells[0], row);
        } else {
          for (std::int64_t x = 0; x < layout.cells[0]; ++x) row[x] = static_cast<Real>(from[x]);
        }
        from += layout.cells[0];
      }
    }
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
