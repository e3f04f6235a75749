// SPDX-License-Identifier: Apache-2.0
// The sums of an operator's rows, A*1, and whether they are 0. They cannot be computed from the entries: each entry is
// a sum of terms, rounded to the last digit of the largest, so that for lap(p) - k*p on 1024^2 cells in f32 the error
// of k would be 0.25. The operator applied to ones is accurate: differences of ones are exactly 0, and k keeps all its
// digits.
//
// Kernels that multiply before they subtract, such as transposes, also leave rounding for ones. To tell rounding from a
// sum, the operator is applied to 3, 5, 7, 11 and 13 in place of 1: a sum scales with these up to its last digit,
// rounding does not. Powers of two would not do, since they change no digits.
#pragma once

#include <span>
#include <vector>

#include "solve/matrix/stencil_matrix.h"
#include "solve/operator/box_probe.h"
#include "solve/rows/constant_rows.h"

namespace dpde {

/// Properties of an operator A that hold for all coefficients: see dpde_solve.
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

/// Computes the sums of the rows in `made`; those that are only rounding are 0. `ones`: memory for values of all cells.
/// `rounding`: relative error of the kernels' results.
void row_sums(const LinearImage& image, const StencilMatrix& matrix, double rounding, std::span<double> ones,
              std::span<double> made, DoubtfulSums& doubtful);
/// The same for a matrix without further knowledge.
std::vector<double> row_sums(const StencilMatrix& matrix, double rounding);
/// The same for an operator with constant rows; `sum` is the image of ones in `cell`.
double row_sum(const LinearImage& image, const ConstantRows& rows, std::size_t cell, double sum, double rounding,
               std::span<double> values, std::span<double> made);

/// Changes diagonals so that rows have these sums, except for rows that differ by more than rounding.
void balance(StencilMatrix& matrix, std::span<const double> sums, double rounding);

}  // namespace dpde
