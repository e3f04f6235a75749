// SPDX-License-Identifier: Apache-2.0
#include "blas_product.h"

namespace dpde::bench {

bool blas_product(int, int, int, const float*, const float*, bool, float*) { return false; }

}  // namespace dpde::bench
