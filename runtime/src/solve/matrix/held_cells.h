// SPDX-License-Identifier: Apache-2.0
// An operator whose solutions are fixed up to its null space: of each singular part one cell is held at 0.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

struct FreeCells {
  std::vector<std::uint32_t> cells;  // that are not held, in order: the rows and columns of the matrix
  Eigen::SparseMatrix<double> matrix;
};
FreeCells without_held_cells(const StencilMatrix& matrix, const NullSpace& null_space);

}  // namespace dpde
