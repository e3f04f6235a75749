// SPDX-License-Identifier: Apache-2.0
// What transforms and solves of a program take: they go over the whole grid, so that it is no number a cell.
#pragma once

#include <string>

#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Bytes that stay as long as the program does, beside its fields, and flops of one run.
struct WholeGridCost {
  double bytes = 0, flops = 0;
  WholeGridCost& operator+=(const WholeGridCost& other) {
    bytes += other.bytes;
    flops += other.flops;
    return *this;
  }
};

/// Of each field of a transform 5 n log2(n) flops for n cells, and 8 for each multiplier; half spectra of complex
/// numbers: two, and one of multipliers for each field.
WholeGridCost cost_of_transforms(const Compiled& compiled, const std::string& program);

/// An estimate: what an operator is, and so the method that fits, is known when it has been run. Bands along one axis;
/// two transforms where nothing but numbers is in the operator; else factors up to 10000 cells, of some 8 log2(n)
/// entries a cell (A. George, SIAM J. Numer. Anal. 10 (1973)), and 12 cycles beyond. Newton's method takes 4 steps.
WholeGridCost cost_of_solves(const Compiled& compiled, const std::string& program);

}  // namespace dpde::driver
