// SPDX-License-Identifier: Apache-2.0
// Row operations of multigrid and conjugate gradients (solve/matrix/half_rows.h), for each instruction set.
#pragma once

#include <cstdint>

#include "solve/matrix/half_rows.h"

namespace dpde {

struct RowPlace {
  std::int64_t number, y, z;
};

/// Index of half a row in a vector: first the half rows of all red cells, then those of the black ones, each preceded
/// by space for a cache line.
template <class Real>
inline std::int64_t place_of(std::int64_t stride, std::int64_t black, std::int64_t number, std::int64_t y,
                             std::int64_t z, int half) {
  return numbers_of_line<Real> + ((y + z + half) % 2 == 0 ? 0 : black) + number * stride;
}

/// Whether levels of this type sum w_ij*(x_i - x_j) and not w_ij*x_j.
template <class Real>
inline constexpr bool has_differences = sizeof(Real) == sizeof(float);

/// A*x of a level over the neighbours j; coefficients row by row. Doubles: diagonal_i*x_i - sum_j w_ij*x_j. Floats:
/// rest_i*x_i + sum_j w_ij*(x_i - x_j): then rounding of coefficients only changes each coupling slightly, while
/// rounding of a diagonal would exceed the small eigenvalues of long waves.
template <class Real>
struct LevelRows {
  std::int64_t cells[3];
  bool is_ring[3];
  std::int64_t odd;                         // rows of coefficients: offset from even to odd cells
  std::int64_t stride, black;               // vectors: from a half row to the next one of its colour; from red to black
  const Real* const* coupling[3];           // of each cell with the next one along the axis
  const Real *const *own, *const *inverse;  // diagonal or rest; 1/diagonal
  bool is_even;                             // couplings along an axis are equal in all cells, except 0 at bounded ends
  Real even[3];                             // their values
};

template <class Real>
struct RowSum {
  std::int64_t count;
  int terms;
  const Real* values[16];
  Real weights[16];
};

/// Products of rows with few entries: result = sum_k values_k*x_k, or added to result.
struct RowProducts {
  static constexpr int most = 16;
  std::int64_t count;
  int terms;
  bool is_added;
  const double* values[most];
  const double* x[most];
};

/// Restriction along x: coarse_i from the fine cells 2i-1 to 2i+2.
template <class Real>
struct RestrictedRow {
  std::int64_t count;
  const Real *even, *odd;
  const Real* weights[4];
};

/// Interpolation along x of a weighted sum of two rows: share*(near*sum_i + far*sum_(i+to_far)).
template <class Real>
struct InterpolatedRow {
  std::int64_t count;
  const Real *near, *far, *share;
  const Real* rows[2];
  Real weights[2];
  std::int64_t to_far;
};

/// Kernels for half a row. Array index: number of axes - 1; `factor`: of a relaxation step. Vectors are those of the
/// level.
template <class Real>
struct RowKernelsOf {
  using Of = const LevelRows<Real>&;
  using At = const RowPlace&;
  void (*scale)(Of level, At row, int half, Real factor, const Real* b, Real* x);  // x = factor*inverse*b
  void (*smooth[3])(Of level, At row, int half, const Real* b, Real* x);           // x = inverse*(b + sum)
  /// The same; returns |b - A*x|^2 of the old x.
  double (*smooth_counted[3])(Of level, At row, int half, const Real* b, Real* x);
  /// to = x + factor*inverse*(b - A*x)
  void (*relax[3])(Of level, At row, int half, Real factor, const Real* b, const Real* x, Real* to);
  void (*residual[3])(Of level, At row, int half, const Real* b, const Real* x, Real* r);   // r = b - A*x
  double (*squared_residual[3])(Of level, At row, int half, const Real* b, const Real* x);  // |b - A*x|^2
  void (*multiply[3])(Of level, At row, int half, const Real* x, Real* y);                  // y = A*x
  void (*interleave)(std::int64_t pairs, const Real* even, const Real* odd, Real* both);
  void (*sum)(const RowSum<Real>& terms, Real* result);
  void (*restrict_along)(const RestrictedRow<Real>& row, Real* coarse);
  void (*add_interpolated)(const InterpolatedRow<Real>& row, Real* x);
  void (*take_share)(std::int64_t count, const Real* share, Real* r);  // r = share*r
  /// even, odd = factor*cells; and back: cells = factor*(even, odd), or added to cells.
  void (*split)(std::int64_t cells, const double* values, double factor, Real* even, Real* odd);
  void (*join)(std::int64_t cells, const Real* even, const Real* odd, double factor, bool is_added, double* values);
};

struct RowKernels {
  void (*add_products)(const RowProducts& terms, double* result);
  RowKernelsOf<double> doubles;
  RowKernelsOf<float> floats;

  template <class Real>
  const RowKernelsOf<Real>& of() const {
    if constexpr (sizeof(Real) == sizeof(float)) {
      return floats;
    } else {
      return doubles;
    }
  }
};

/// The kernels for this processor.
const RowKernels& row_kernels();

RowKernels row_kernels_portable();
RowKernels row_kernels_v3();
RowKernels row_kernels_v4();

}  // namespace dpde
