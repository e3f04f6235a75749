// SPDX-License-Identifier: Apache-2.0
#include "solve/sparse_product.h"

#include "solve/vector_parts.h"

namespace dpde {

void multiply(const Eigen::SparseMatrix<double, Eigen::RowMajor>& rows, std::span<const double> x, std::span<double> y,
              const Team& team) {
  const int* const begins = rows.outerIndexPtr();
  const int* const columns = rows.innerIndexPtr();
  const double* const values = rows.valuePtr();
  VectorParts(y.size()).for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t) {
    for (std::size_t row = begin; row < end; ++row) {
      double sum = 0;
      for (int k = begins[row]; k < begins[row + 1]; ++k) sum += values[k] * x[static_cast<std::size_t>(columns[k])];
      y[row] = sum;
    }
  });
}

}  // namespace dpde
