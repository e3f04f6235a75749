// SPDX-License-Identifier: Apache-2.0
#include "solve/symmetric_factors.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "solve/held_cells.h"

namespace dpde {

SymmetricFactors::SymmetricFactors(const StencilMatrix& matrix, std::span<const double> sums)
    : null_space_(matrix, sums, 0x1p-52, {.is_symmetric = true}) {
  const auto [free, sparse] = without_held_cells(matrix, null_space_);
  if (free.empty()) return;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(sparse);
  is_there_ = factors.info() == Eigen::Success && (factors.vectorD().array() != 0).all();
  if (!is_there_) return;
  lower_ = factors.matrixL().nestedExpression();
  inverse_.resize(free.size());
  cells_.resize(free.size());
  values_.resize(free.size());
  for (std::size_t i = 0; i < free.size(); ++i) {
    inverse_[i] = 1 / factors.vectorD()[static_cast<Eigen::Index>(i)];
    const auto row = static_cast<std::size_t>(factors.permutationP().indices()[static_cast<Eigen::Index>(i)]);
    cells_[row] = free[i];
  }
}

void SymmetricFactors::solve(std::span<double> b, std::span<double> x) {
  null_space_.remove(b);
  std::ranges::fill(x, 0.0);
  const auto size = static_cast<Eigen::Index>(cells_.size());
  for (std::size_t i = 0; i < cells_.size(); ++i) values_[i] = b[cells_[i]];
  for (Eigen::Index column = 0; column < size; ++column) {
    const double value = values_[static_cast<std::size_t>(column)];
    for (Eigen::SparseMatrix<double>::InnerIterator entry(lower_, column); entry; ++entry) {
      if (entry.row() > column) values_[static_cast<std::size_t>(entry.row())] -= entry.value() * value;
    }
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) values_[i] *= inverse_[i];
  for (Eigen::Index column = size; column-- > 0;) {
    double& value = values_[static_cast<std::size_t>(column)];
    for (Eigen::SparseMatrix<double>::InnerIterator entry(lower_, column); entry; ++entry) {
      if (entry.row() > column) value -= entry.value() * values_[static_cast<std::size_t>(entry.row())];
    }
  }
  for (std::size_t i = 0; i < cells_.size(); ++i) x[cells_[i]] = values_[i];
  null_space_.remove(x);
}

}  // namespace dpde
