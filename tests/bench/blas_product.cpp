// SPDX-License-Identifier: Apache-2.0
#include "blas_product.h"

#include <cblas.h>

namespace dpde::bench {

bool blas_product(int rows, int columns, int inner, const float* a, const float* b, bool is_transposed, float* c) {
  cblas_sgemm(CblasRowMajor, CblasNoTrans, is_transposed ? CblasTrans : CblasNoTrans, rows, columns, inner, 1, a, inner,
              b, is_transposed ? inner : columns, 0, c, columns);
  return true;
}

}  // namespace dpde::bench
