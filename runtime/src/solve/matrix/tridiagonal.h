// SPDX-License-Identifier: Apache-2.0
// Three entries a row in 1-D, eliminated from one end to the other; around a ring by a change of rank one (Sherman and
// Morrison 1950). Rows are dominated by their diagonals, so that nothing is exchanged.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

class TridiagonalSolver {
 public:
  /// Nothing where the operator has another form.
  static std::optional<TridiagonalSolver> of(const StencilMatrix& matrix, const NullSpace& null_space);
  /// The same in place of what it was; false: it is of no use then.
  bool set(const StencilMatrix& matrix, const NullSpace& null_space);

  /// `b` is compatible; of `x` the null space is still to be removed.
  void solve(std::span<const double> b, std::span<double> x) const;

 private:
  void eliminate(std::span<double> x) const;

  std::vector<double> lower_, diagonal_, pivot_, upper_;  // pivot: 1/diagonal after elimination
  std::vector<double> ring_;                              // A^-1 of the column of the change
  double ring_first_ = 0, ring_last_ = 0;                 // the row of the change
  double ring_scale_ = 0;
  bool is_ring_ = false, holds_first_ = false;
};

}  // namespace dpde
