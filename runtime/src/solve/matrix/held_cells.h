// SPDX-License-Identifier: Apache-2.0
// Makes an operator nonsingular that is singular up to its null space: in each singular part one cell is fixed to 0.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

struct FreeCells {
  std::vector<std::uint32_t> cells;  // not fixed, in order: the rows and columns of the matrix
  Eigen::SparseMatrix<double> matrix;
};
FreeCells without_held_cells(const StencilMatrix& matrix, const NullSpace& null_space);

}  // namespace dpde
