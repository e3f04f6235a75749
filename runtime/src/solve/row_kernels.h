// SPDX-License-Identifier: Apache-2.0
// What multigrid and conjugate gradients do along rows (solve/half_rows.h), for each instruction set.
#pragma once

#include <cstdint>

namespace dpde {

struct RowPlace {
  std::int64_t number, y, z;
};

/// Where half a row is in vectors: those of all red cells lie one behind the other, and behind them the black ones,
/// each with room before it.
inline std::int64_t place_of(std::int64_t stride, std::int64_t black, std::int64_t number, std::int64_t y,
                             std::int64_t z, int half) {
  constexpr std::int64_t room = 8;
  return room + ((y + z + half) % 2 == 0 ? 0 : black) + number * stride;
}

/// A*x of a level, (A*x)_i = diagonal_i*x_i - sum_j w_ij*x_j over the neighbours j; coefficients row by row.
struct LevelRows {
  std::int64_t cells[3];
  bool is_ring[3];
  std::int64_t odd;            // of rows of coefficients: from the even cells to the odd ones
  std::int64_t stride, black;  // of vectors: from a half row to the next one of its colour, from red to black ones
  const double* const* coupling[3];  // of each cell with the next one along the axis
  const double *const *diagonal, *const *inverse;
  bool is_even;    // couplings along an axis are the same in all cells, but for 0 at bounded ends
  double even[3];  // these
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

/// Interpolation along x between sums of two rows: share*(near*sum_i + far*sum_(i+to_far)).
struct InterpolatedRow {
  std::int64_t count;
  const double *near, *far, *share;
  const double* rows[2];
  double weights[2];
  std::int64_t to_far;
};

/// One half of a row. Index: the number of axes - 1; `factor`: of a step of relaxation. Vectors are those of the level.
struct RowKernels {
  using Of = const LevelRows&;
  using At = const RowPlace&;
  void (*scale)(Of level, At row, int half, double factor, const double* b, double* x);  // x = factor*inverse*b
  void (*smooth[3])(Of level, At row, int half, const double* b, double* x);             // x = inverse*(b + sum)
  /// The same; |b - A*x|^2 of what was there before.
  double (*smooth_counted[3])(Of level, At row, int half, const double* b, double* x);
  /// to = x + factor*inverse*(b - A*x)
  void (*relax[3])(Of level, At row, int half, double factor, const double* b, const double* x, double* to);
  void (*residual[3])(Of level, At row, int half, const double* b, const double* x, double* r);  // r = b - A*x
  double (*squared_residual[3])(Of level, At row, int half, const double* b, const double* x);   // |b - A*x|^2
  void (*multiply[3])(Of level, At row, int half, const double* x, double* y);                   // y = A*x
  void (*interleave)(std::int64_t pairs, const double* even, const double* odd, double* both);
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
