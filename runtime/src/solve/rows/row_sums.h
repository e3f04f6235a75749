// SPDX-License-Identifier: Apache-2.0
// The sums of an operator's rows, A*1, and whether they are 0. Entries do not say: each is a sum of terms, rounded to
// the last digit of the largest, so that those of lap(p) - k*p on 1024^2 cells in f32 leave k to 0.25. What kernels
// make of ones does: differences of ones are 0, whatever they are multiplied by, and k is left to its own last digit.
//
// Kernels that do not subtract before they multiply, as transposes, leave rounding of ones too. That is told from a sum
// by what they make of 3, 5, 7, 11 and 13 in the place of 1: of what is linear as many times as much, but for its last
// digit, and of rounding anything. Powers of two would not tell, as they change no digits.
#pragma once

#include <span>
#include <vector>

#include "solve/matrix/stencil_matrix.h"
#include "solve/operator/box_probe.h"
#include "solve/rows/constant_rows.h"

namespace dpde {

/// What is known of an operator A whatever its coefficients are: dpde_solve.
struct OperatorKnowledge {
  bool is_symmetric = false;
  bool takes_constants_to_zero = false;  // A*1 = 0
  bool sums_to_zero = false;             // A^T*1 = 0
  bool has_coefficients = true;          // fields
  bool operator==(const OperatorKnowledge&) const = default;
};

/// Rows whose sums may be rounding.
struct DoubtfulSums {
  std::vector<std::size_t> cells;
  std::vector<double> largest, sums;  // the largest entry of the row
};

/// Of each row, in `made`; what is nothing but rounding is 0. `ones`: memory for values of all cells. `rounding`:
/// relative error of what kernels make.
void row_sums(const LinearImage& image, const StencilMatrix& matrix, double rounding, std::span<double> ones,
              std::span<double> made, DoubtfulSums& doubtful);
/// The same of a matrix that is all that is known.
std::vector<double> row_sums(const StencilMatrix& matrix, double rounding);
/// The same of an operator with these rows away from walls, of one of which it makes `sum` in a cell that is there.
double row_sum(const LinearImage& image, const ConstantRows& rows, std::size_t cell, double sum, double rounding,
               std::span<double> values, std::span<double> made);

/// Changes diagonals so that rows have these sums, but for those that are off by more than rounding.
void balance(StencilMatrix& matrix, std::span<const double> sums, double rounding);

}  // namespace dpde
