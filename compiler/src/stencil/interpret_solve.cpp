// SPDX-License-Identifier: Apache-2.0
// The meaning of a solve: the matrix of the operator, a column for each cell, and its pseudo-inverse.
#include <Eigen/QR>

#include "stencil/interpret.h"
#include "support/assert.h"

namespace dpde::stencil {

std::vector<double> smallest_solution(const Image& image, const std::vector<double>& right, Precision real) {
  const auto cells = static_cast<Eigen::Index>(right.size());
  Eigen::MatrixXd matrix(cells, cells);
  std::vector<double> unit(right.size(), 0.0);
  for (Eigen::Index column = 0; column < cells; ++column) {
    unit[static_cast<std::size_t>(column)] = 1;
    const std::vector<double> of_unit = image(unit);
    require(of_unit.size() == right.size(), "an image in all cells");
    matrix.col(column) = Eigen::Map<const Eigen::VectorXd>(of_unit.data(), cells);
    unit[static_cast<std::size_t>(column)] = 0;
  }
  // Of differences in one cell nothing is left, but for what rounding leaves: that is not proportional to the values.
  for (const double value : {3.0, 5.0, 7.0, 11.0, 13.0}) {
    if (cells == 1 && std::abs(image({value}).front() - value * matrix(0, 0)) > 1e-3 * std::abs(value * matrix(0, 0)))
      matrix(0, 0) = 0;
  }
  const double rounding = real == Precision::f32 ? 0x1p-23 : 0x1p-52;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse;
  inverse.setThreshold(64 * rounding * static_cast<double>(cells));  // entries are rounded: 0 is not quite 0
  const Eigen::VectorXd x = inverse.compute(matrix).solve(Eigen::Map<const Eigen::VectorXd>(right.data(), cells));
  return {x.data(), x.data() + cells};
}

}  // namespace dpde::stencil
