// SPDX-License-Identifier: Apache-2.0
// The loops of row_kernels.h. Each source that includes this compiles them for another instruction set. Everything has
// internal linkage, so that no other source uses this code.
#pragma once

#include <type_traits>

#include "solve/rows/row_kernels.h"

namespace dpde {
namespace {

/// Pointers of half a row and its neighbours.
template <int rank, class Real>
struct HalfRow {
  std::int64_t count, begin;  // cells; index of the first in a vector
  const Real *own, *inverse;
  const Real* x[2 * rank];
  const Real* w[2 * rank];
  Real even[2 * rank];
};

/// Beyond bounded ends couplings are 0, or x is 0 in the extra spaces of a row: reading there contributes nothing.
template <int rank, bool is_even, class Real>
inline HalfRow<rank, Real> half_row(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* x) {
  const std::int64_t here = half == 0 ? 0 : level.odd, other = level.odd - here;
  const auto place = [&](std::int64_t number, std::int64_t y, std::int64_t z, int of_half) {
    return place_of<Real>(level.stride, level.black, number, y, z, of_half);
  };
  HalfRow<rank, Real> made;
  made.count = (level.cells[0] + 1 - half) / 2;
  made.begin = place(row.number, row.y, row.z, half);
  made.own = level.own[row.number] + here;
  made.inverse = level.inverse[row.number] + here;
  made.x[0] = x + place(row.number, row.y, row.z, 1 - half) + half;
  made.x[1] = made.x[0] - 1;
  if constexpr (is_even) {
    made.even[0] = made.even[1] = level.even[0];
  } else {
    made.w[0] = level.coupling[0][row.number] + here;
    made.w[1] = level.coupling[0][row.number] + other + half - 1;
  }
  for (int axis = 1; axis < rank; ++axis) {
    const std::int64_t step = axis == 1 ? 1 : level.cells[1], along = axis == 1 ? row.y : row.z;
    const std::int64_t cells = level.cells[axis], across = axis == 1 ? row.z : row.y;
    const bool is_first = along == 0, is_last = along + 1 == cells, is_ring = level.is_ring[axis];
    const std::int64_t to_next = is_last ? 1 - cells : 1, to_before = is_first ? cells - 1 : -1;
    const std::int64_t next = row.number + step * to_next, before = row.number + step * to_before;
    made.x[2 * axis] = x + place(next, along + to_next, across, half);
    made.x[2 * axis + 1] = x + place(before, along + to_before, across, half);
    if constexpr (is_even) {
      made.even[2 * axis] = is_last && !is_ring ? 0 : level.even[axis];
      made.even[2 * axis + 1] = is_first && !is_ring ? 0 : level.even[axis];
    } else {
      made.w[2 * axis] = level.coupling[axis][row.number] + here;
      made.w[2 * axis + 1] = level.coupling[axis][before] + here;
    }
  }
  return made;
}

/// sum_j w_ij*f(x_j)
template <int rank, bool is_even, class Real, class F>
inline Real sum_over_neighbours(const HalfRow<rank, Real>& t, std::int64_t i, const F& f) {
  const auto part = [&](int k) { return (is_even ? t.even[k] : t.w[k][i]) * f(t.x[k][i]); };
  Real sum = part(0) + part(1);
  if constexpr (rank > 1) sum += part(2) + part(3);
  if constexpr (rank > 2) sum += part(4) + part(5);
  return sum;
}
template <int rank, bool is_even, class Real>
inline Real sum_of_neighbours(const HalfRow<rank, Real>& t, std::int64_t i) {
  return sum_over_neighbours<rank, is_even>(t, i, [](Real other) { return other; });
}

/// right - A*x in the cell with x = `here`.
template <int rank, bool is_even, class Real>
inline Real left_of(const HalfRow<rank, Real>& t, std::int64_t i, Real right, Real here) {
  if constexpr (has_differences<Real>) {
    return right - t.own[i] * here + sum_over_neighbours<rank, is_even>(t, i, [=](Real x) { return x - here; });
  } else {
    return right - t.own[i] * here + sum_of_neighbours<rank, is_even>(t, i);
  }
}

/// Calls `of`(std::true_type) if couplings are constant, else `of`(std::false_type).
template <class Real, class Of>
inline auto by_couplings(const LevelRows<Real>& level, const Of& of) {
  return level.is_even ? of(std::true_type()) : of(std::false_type());
}

template <class Real>
void scale(const LevelRows<Real>& level, const RowPlace& row, int half, Real factor, const Real* b, Real* x) {
  const HalfRow<1, Real> t = half_row<1, true, Real>(level, row, half, x);
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) x[t.begin + i] = factor * t.inverse[i] * b[t.begin + i];
}

template <int rank, class Real>
void smooth(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* b, Real* x) {
  by_couplings(level, [&]<bool is_even>(std::bool_constant<is_even>) {
    const HalfRow<rank, Real> t = half_row<rank, is_even, Real>(level, row, half, x);
#pragma omp simd
    for (std::int64_t i = 0; i < t.count; ++i)
      x[t.begin + i] = t.inverse[i] * (b[t.begin + i] + sum_of_neighbours<rank, is_even>(t, i));
  });
}

template <int rank, bool is_even, class Real>
double smooth_and_count(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* b, Real* x) {
  const HalfRow<rank, Real> t = half_row<rank, is_even, Real>(level, row, half, x);
  Real squares = 0;
#pragma omp simd reduction(+ : squares)
  for (std::int64_t i = 0; i < t.count; ++i) {
    if constexpr (has_differences<Real>) {
      const Real here = x[t.begin + i], left = left_of<rank, is_even>(t, i, b[t.begin + i], here);
      squares += left * left;
      x[t.begin + i] = here + t.inverse[i] * left;
    } else {
      const Real wanted = b[t.begin + i] + sum_of_neighbours<rank, is_even>(t, i);
      const Real left = wanted - t.own[i] * x[t.begin + i];
      squares += left * left;
      x[t.begin + i] = t.inverse[i] * wanted;
    }
  }
  return squares;
}
template <int rank, class Real>
double smooth_counted(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* b, Real* x) {
  return level.is_even ? smooth_and_count<rank, true>(level, row, half, b, x)
                       : smooth_and_count<rank, false>(level, row, half, b, x);
}

template <int rank, class Real>
void relax(const LevelRows<Real>& level, const RowPlace& row, int half, Real factor, const Real* b, const Real* x,
           Real* to) {
  by_couplings(level, [&]<bool is_even>(std::bool_constant<is_even>) {
    const HalfRow<rank, Real> t = half_row<rank, is_even, Real>(level, row, half, x);
#pragma omp simd
    for (std::int64_t i = 0; i < t.count; ++i) {
      const Real here = x[t.begin + i];
      to[t.begin + i] = here + factor * t.inverse[i] * left_of<rank, is_even>(t, i, b[t.begin + i], here);
    }
  });
}

template <int rank, class Real>
void residual(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* b, const Real* x, Real* r) {
  by_couplings(level, [&]<bool is_even>(std::bool_constant<is_even>) {
    const HalfRow<rank, Real> t = half_row<rank, is_even, Real>(level, row, half, x);
#pragma omp simd
    for (std::int64_t i = 0; i < t.count; ++i)
      r[t.begin + i] = left_of<rank, is_even>(t, i, b[t.begin + i], x[t.begin + i]);
  });
}

template <int rank, bool is_even, class Real>
double squares_of(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* b, const Real* x) {
  const HalfRow<rank, Real> t = half_row<rank, is_even, Real>(level, row, half, x);
  Real squares = 0;
#pragma omp simd reduction(+ : squares)
  for (std::int64_t i = 0; i < t.count; ++i) {
    const Real left = left_of<rank, is_even>(t, i, b[t.begin + i], x[t.begin + i]);
    squares += left * left;
  }
  return squares;
}
template <int rank, class Real>
double squared_residual(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* b, const Real* x) {
  return level.is_even ? squares_of<rank, true>(level, row, half, b, x)
                       : squares_of<rank, false>(level, row, half, b, x);
}

template <int rank, class Real>
void multiply(const LevelRows<Real>& level, const RowPlace& row, int half, const Real* x, Real* y) {
  by_couplings(level, [&]<bool is_even>(std::bool_constant<is_even>) {
    const HalfRow<rank, Real> t = half_row<rank, is_even, Real>(level, row, half, x);
#pragma omp simd
    for (std::int64_t i = 0; i < t.count; ++i) {
      if constexpr (has_differences<Real>) {
        y[t.begin + i] = -left_of<rank, is_even>(t, i, Real(0), x[t.begin + i]);
      } else {
        y[t.begin + i] = t.own[i] * x[t.begin + i] - sum_of_neighbours<rank, is_even>(t, i);
      }
    }
  });
}

template <class Real>
void interleave(std::int64_t pairs, const Real* even, const Real* odd, Real* both) {
#pragma omp simd
  for (std::int64_t i = 0; i < pairs; ++i) both[2 * i] = even[i], both[2 * i + 1] = odd[i];
}

template <int terms, class Real>
void sum_some(const RowSum<Real>& sum, int first, Real* result) {
  const Real* values[terms];
  Real weights[terms];
  for (int k = 0; k < terms; ++k) values[k] = sum.values[first + k], weights[k] = sum.weights[first + k];
#pragma omp simd
  for (std::int64_t i = 0; i < sum.count; ++i) {
    Real value = first == 0 ? 0 : result[i];
    for (int k = 0; k < terms; ++k) value += weights[k] * values[k][i];
    result[i] = value;
  }
}

template <class Real>
void sum_rows(const RowSum<Real>& sum, Real* result) {
  if (sum.terms == 0) {
    for (std::int64_t i = 0; i < sum.count; ++i) result[i] = 0;
  }
  for (int first = 0; first < sum.terms;) {
    const int left = sum.terms - first, now = left >= 4 ? 4 : left >= 2 ? 2 : 1;
    (now == 4 ? sum_some<4, Real> : now == 2 ? sum_some<2, Real> : sum_some<1, Real>)(sum, first, result);
    first += now;
  }
}

template <class Real>
void restrict_along(const RestrictedRow<Real>& given, Real* coarse) {
  const RestrictedRow<Real> row = given;
#pragma omp simd
  for (std::int64_t i = 0; i < row.count; ++i)
    coarse[i] = row.weights[0][i] * row.odd[i - 1] + row.weights[1][i] * row.even[i] + row.weights[2][i] * row.odd[i] +
                row.weights[3][i] * row.even[i + 1];
}

template <class Real>
void add_interpolated(const InterpolatedRow<Real>& given, Real* x) {
  const InterpolatedRow<Real> row = given;
  const Real *one = row.rows[0], *other = row.rows[1];
  const Real *far_one = one + row.to_far, *far_other = other + row.to_far;
#pragma omp simd
  for (std::int64_t i = 0; i < row.count; ++i) {
    const Real near = row.weights[0] * one[i] + row.weights[1] * other[i],
               far = row.weights[0] * far_one[i] + row.weights[1] * far_other[i];
    x[i] += row.share[i] * (row.near[i] * near + row.far[i] * far);
  }
}

template <class Real>
void take_share(std::int64_t count, const Real* share, Real* r) {
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) r[i] *= share[i];
}

template <class Real>
void split(std::int64_t cells, const double* values, double factor, Real* even, Real* odd) {
#pragma omp simd
  for (std::int64_t i = 0; i < cells / 2; ++i) {
    even[i] = static_cast<Real>(factor * values[2 * i]);
    odd[i] = static_cast<Real>(factor * values[2 * i + 1]);
  }
  if (cells % 2 == 1) even[cells / 2] = static_cast<Real>(factor * values[cells - 1]);
}

template <bool is_added, class Real>
void join_some(std::int64_t cells, const Real* even, const Real* odd, double factor, double* values) {
  const auto become = [](double& value, double made) { value = is_added ? value + made : made; };
#pragma omp simd
  for (std::int64_t i = 0; i < cells / 2; ++i) {
    become(values[2 * i], factor * even[i]);
    become(values[2 * i + 1], factor * odd[i]);
  }
  if (cells % 2 == 1) become(values[cells - 1], factor * even[cells / 2]);
}
template <class Real>
void join(std::int64_t cells, const Real* even, const Real* odd, double factor, bool is_added, double* values) {
  (is_added ? join_some<true, Real> : join_some<false, Real>)(cells, even, odd, factor, values);
}

template <int terms>
void add_some_products(const RowProducts& products, int first, bool is_added, double* result) {
  const double *values[terms], *x[terms];
  for (int k = 0; k < terms; ++k) values[k] = products.values[first + k], x[k] = products.x[first + k];
#pragma omp simd
  for (std::int64_t i = 0; i < products.count; ++i) {
    double sum = is_added ? result[i] : 0;
    for (int k = 0; k < terms; ++k) sum += values[k][i] * x[k][i];
    result[i] = sum;
  }
}

void add_products(const RowProducts& products, double* result) {
  for (int first = 0; first < products.terms;) {
    const int left = products.terms - first, now = left >= 7 ? 7 : left >= 5 ? 5 : left >= 3 ? 3 : 1;
    const auto add = now == 7   ? add_some_products<7>
                     : now == 5 ? add_some_products<5>
                     : now == 3 ? add_some_products<3>
                                : add_some_products<1>;
    add(products, first, products.is_added || first > 0, result);
    first += now;
  }
}

template <class Real>
RowKernelsOf<Real> loops_of() {
  return {.scale = scale<Real>,
          .smooth = {smooth<1, Real>, smooth<2, Real>, smooth<3, Real>},
          .smooth_counted = {smooth_counted<1, Real>, smooth_counted<2, Real>, smooth_counted<3, Real>},
          .relax = {relax<1, Real>, relax<2, Real>, relax<3, Real>},
          .residual = {residual<1, Real>, residual<2, Real>, residual<3, Real>},
          .squared_residual = {squared_residual<1, Real>, squared_residual<2, Real>, squared_residual<3, Real>},
          .multiply = {multiply<1, Real>, multiply<2, Real>, multiply<3, Real>},
          .interleave = interleave<Real>,
          .sum = sum_rows<Real>,
          .restrict_along = restrict_along<Real>,
          .add_interpolated = add_interpolated<Real>,
          .take_share = take_share<Real>,
          .split = split<Real>,
          .join = join<Real>};
}

RowKernels loops() { return {add_products, loops_of<double>(), loops_of<float>()}; }

}  // namespace
}  // namespace dpde
