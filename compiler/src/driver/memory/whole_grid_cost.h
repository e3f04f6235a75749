// SPDX-License-Identifier: Apache-2.0
// Cost of a program's transforms and solves. These act on the whole grid, so the cost is not a number per cell.
#pragma once

#include <string>

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Memory allocated for the program's lifetime in addition to its fields, and flops of one run.
struct WholeGridCost {
  double bytes = 0, flops = 0;
  WholeGridCost& operator+=(const WholeGridCost& other) {
    bytes += other.bytes;
    flops += other.flops;
    return *this;
  }
};

/// For each field of a transform of n cells: 5 n log2(n) flops, plus 8 for each multiplier. Memory: complex half
/// spectra, two and one of multipliers for each field.
WholeGridCost cost_of_transforms(const Compiled& compiled, const std::string& program);

/// An estimate, since operator and method are known only at run time. Bands along one axis; two transforms if the
/// operator has constant coefficients; else factorisation up to 10000 cells, with 8 log2(n) entries per cell (A.
/// George, SIAM J. Numer. Anal. 10 (1973)), and 12 cycles beyond. Newton's method takes 4 steps.
WholeGridCost cost_of_solves(const Compiled& compiled, const std::string& program);

}  // namespace dpde::driver
