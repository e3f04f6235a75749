// SPDX-License-Identifier: Apache-2.0
// What multigrid and conjugate gradients do along rows (solve/half_rows.h), for each instruction set.
#pragma once

#include <cstdint>

namespace dpde {

/// One half of a row of A*x = b: (A*x)_i = diagonal_i*x_i - sum_k w[k]_i*x[k]_i over the neighbours k.
struct RowTerms {
  std::int64_t count;
  const double *b, *diagonal, *inverse;
  const double* x[6];
  const double* w[6];
};

struct RowSum {
  std::int64_t count;
  int terms;
  const double* values[16];
  double weights[16];
};

/// Restriction along x: coarse_i takes of the fine cells 2i-1 to 2i+2.
struct RestrictedRow {
  std::int64_t count;
  const double *even, *odd;
  const double* weights[4];
};

/// Interpolation along x: share*(near*at_near + far*at_far).
struct InterpolatedRow {
  std::int64_t count;
  const double *near, *far, *share;
  const double *at_near, *at_far;
};

/// Index: the number of axes - 1; `factor`: of a step of relaxation.
struct RowKernels {
  void (*scale)(const RowTerms& terms, double* x);                                      // x = inverse*b
  void (*smooth[3])(const RowTerms& terms, double* x);                                  // x = inverse*(b + sum)
  void (*scale_by)(const RowTerms& terms, double factor, double* x);                    // x = factor*inverse*b
  void (*relax[3])(const RowTerms& terms, double factor, const double* x, double* to);  // x + factor*inverse*(b - A*x)
  void (*residual[3])(const RowTerms& terms, const double* x, double* r);               // r = b - A*x
  double (*squared_residual[3])(const RowTerms& terms, const double* x);                // |b - A*x|^2
  void (*multiply[3])(const RowTerms& terms, const double* x, double* y);               // y = A*x
  void (*sum)(const RowSum& terms, double* result);
  void (*restrict_along)(const RestrictedRow& row, double* coarse);
  void (*add_interpolated)(const InterpolatedRow& row, double* x);
  void (*take_share)(std::int64_t count, const double* share, double* r);  // r = share*r
};

/// Of the processor this runs on.
const RowKernels& row_kernels();

RowKernels row_kernels_portable();
RowKernels row_kernels_v3();
RowKernels row_kernels_v4();

}  // namespace dpde
