// SPDX-License-Identifier: Apache-2.0
// Tridiagonal systems in 1-D by elimination; periodic ones by a rank-one update (Sherman and Morrison 1950). Rows must
// be diagonally dominant, since there is no pivoting.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

class TridiagonalSolver {
 public:
  /// Empty if the operator has another form.
  static std::optional<TridiagonalSolver> of(const StencilMatrix& matrix, const NullSpace& null_space);
  /// The same in place; false: the object is then unusable.
  bool set(const StencilMatrix& matrix, const NullSpace& null_space);

  /// `b` must be compatible; the null space must still be removed from `x`.
  void solve(std::span<const double> b, std::span<double> x) const;

 private:
  void eliminate(std::span<double> x) const;

  std::vector<double> lower_, diagonal_, pivot_, upper_;  // pivot: 1/diagonal after elimination
  std::vector<double> ring_;                              // A^-1 applied to the column vector of the update
  double ring_first_ = 0, ring_last_ = 0;                 // the row vector of the update
  double ring_scale_ = 0;
  bool is_ring_ = false, holds_first_ = false;
};

}  // namespace dpde
