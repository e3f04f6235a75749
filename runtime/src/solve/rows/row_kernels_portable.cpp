// SPDX-License-Identifier: Apache-2.0
#include "solve/rows/row_kernels.h"
#include "solve/rows/row_loops.h"

namespace dpde {

RowKernels row_kernels_portable() { return loops(); }

}  // namespace dpde
