// SPDX-License-Identifier: Apache-2.0
// Products of matrices by OpenBLAS, to compare convolutions with; where it is not installed there are none.
#pragma once

namespace dpde::bench {

/// c = a*b, or a*b^T: a of `rows` x `inner`, c of `rows` x `columns`, rows one after the other. False without OpenBLAS.
bool blas_product(int rows, int columns, int inner, const float* a, const float* b, bool is_transposed, float* c);

}  // namespace dpde::bench
