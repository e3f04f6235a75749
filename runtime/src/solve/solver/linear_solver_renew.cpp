// SPDX-License-Identifier: Apache-2.0
// Renews a solver for changed coefficients: the same method in the same memory.
#include <algorithm>
#include <cmath>
#include <utility>

#include "solve/solver/linear_solver_impl.h"

namespace dpde {
namespace {

/// Whether entries away from walls are constant along some axis, a requirement of Fourier series of any kind.
bool has_even_axis(const StencilMatrix& matrix) {
  std::array<std::int64_t, 3> reach{};
  for (const std::array<int, 3>& offset : matrix.offsets) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      reach[axis] = std::max<std::int64_t>(reach[axis], std::abs(offset[axis]));
  }
  std::array<bool, 3> is_even{};
  for (std::size_t axis = 0; axis < 3; ++axis) is_even[axis] = matrix.cells[axis] > 1;
  for_each_cell(matrix.cells, [&](std::size_t number, const GridPlace& cell) {
    if (!is_even[0] && !is_even[1] && !is_even[2]) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!matrix.periodic[axis] && (cell[axis] < reach[axis] || cell[axis] >= matrix.cells[axis] - reach[axis]))
        return;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      GridPlace middle = cell;
      middle[axis] = matrix.cells[axis] / 2;
      const std::size_t other = number_of(matrix.cells, middle);
      double size = 0, difference = 0;
      for (const std::vector<double>& column : matrix.values) {
        size += std::abs(column[number]);
        difference = std::max(difference, std::abs(column[number] - column[other]));
      }
      is_even[axis] = is_even[axis] && difference <= 4 * difference_of_same_rows * size;
    }
  });
  return is_even[0] || is_even[1] || is_even[2];
}

}  // namespace

/// Throws nothing: making a new solver finds the reason.
bool LinearSolver::Impl::renew(std::shared_ptr<const GridOperator> given) {
  a = std::move(given);
  const auto size = static_cast<std::size_t>(a->size());
  if (Rooms(null_space(), size) != rooms) return false;
  largest_row = a->largest_row();
  if (!renew_method()) return false;
  if (has_own_right()) {
    right.assign(size, 0.0);
  } else {
    right.clear();
  }
  return true;
}

/// Must agree with choose().
bool LinearSolver::Impl::renew_method() {
  const bool is_automatic = options.method == SolverMethod::automatic;
  const bool is_lopsided = null_space().is_lopsided();
  if (a->constant_rows() != nullptr || is_lopsided || fourier || lines) return false;
  return a->with_matrix([&](const StencilMatrix& matrix) {
    if (tridiagonal) return tridiagonal->set(matrix, null_space());
    if (is_automatic && (a->size() == a->cells()[0] || has_even_axis(matrix))) return false;
    if (direct) return direct->renew(matrix, null_space());
    // For symmetric operators choose() takes cg.
    const bool is_for_unsymmetric = method == SolverMethod::bicgstab || method == SolverMethod::gmres;
    if (is_automatic && is_for_unsymmetric && a->is_symmetric(options.rounding)) return false;
    if (multigrid) return multigrid->renew(matrix, null_space(), a->is_known_symmetric());
    if (in_floats.cycles) return in_floats.cycles->renew(matrix, null_space(), a->is_known_symmetric());
    const bool is_plain = options.preconditioning == Preconditioning::none || is_flexible();
    return is_plain && (method != SolverMethod::cg || a->is_symmetric(options.rounding));
  });
}

}  // namespace dpde
