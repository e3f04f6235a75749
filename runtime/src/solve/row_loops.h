// SPDX-License-Identifier: Apache-2.0
// The loops of row_kernels.h; each source that includes this compiles them for another instruction set. Nothing in it
// has a name outside of the source, so that no other takes the code.
#pragma once

#include "solve/row_kernels.h"

namespace dpde {
namespace {

/// One half of a row and what stands around it.
template <int rank>
struct HalfRow {
  std::int64_t count, begin;  // cells; where they begin in a vector
  const double *diagonal, *inverse;
  const double* x[2 * rank];
  const double* w[2 * rank];
  double even[2 * rank];
};

/// Beyond bounded ends couplings are 0, or x is, in the rooms of a row: reading around them takes nothing.
template <int rank, bool is_even>
inline HalfRow<rank> half_row(const LevelRows& level, const RowPlace& row, int half, const double* x) {
  const std::int64_t here = half == 0 ? 0 : level.odd, other = level.odd - here;
  const auto place = [&](std::int64_t number, std::int64_t y, std::int64_t z, int of_half) {
    return place_of(level.stride, level.black, number, y, z, of_half);
  };
  HalfRow<rank> made;
  made.count = (level.cells[0] + 1 - half) / 2;
  made.begin = place(row.number, row.y, row.z, half);
  made.diagonal = level.diagonal[row.number] + here;
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

template <int rank, bool is_even>
inline double sum_of_neighbours(const HalfRow<rank>& t, std::int64_t i) {
  const auto part = [&](int k) { return (is_even ? t.even[k] : t.w[k][i]) * t.x[k][i]; };
  double sum = part(0) + part(1);
  if constexpr (rank > 1) sum += part(2) + part(3);
  if constexpr (rank > 2) sum += part(4) + part(5);
  return sum;
}

/// f(the half row, i, the sum of its neighbours) of each cell.
template <int rank, bool is_even, class F>
inline void over_cells(const LevelRows& level, const RowPlace& row, int half, const double* x, const F& f) {
  const HalfRow<rank> t = half_row<rank, is_even>(level, row, half, x);
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) f(t, i, sum_of_neighbours<rank, is_even>(t, i));
}
template <int rank, class F>
inline void over_cells(const LevelRows& level, const RowPlace& row, int half, const double* x, const F& f) {
  level.is_even ? over_cells<rank, true>(level, row, half, x, f) : over_cells<rank, false>(level, row, half, x, f);
}

void scale(const LevelRows& level, const RowPlace& row, int half, double factor, const double* b, double* x) {
  const HalfRow<1> t = half_row<1, true>(level, row, half, x);
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) x[t.begin + i] = factor * t.inverse[i] * b[t.begin + i];
}

template <int rank>
void smooth(const LevelRows& level, const RowPlace& row, int half, const double* b, double* x) {
  over_cells<rank>(level, row, half, x, [=](const HalfRow<rank>& t, std::int64_t i, double sum) {
    x[t.begin + i] = t.inverse[i] * (b[t.begin + i] + sum);
  });
}

template <int rank, bool is_even>
double smooth_and_count(const LevelRows& level, const RowPlace& row, int half, const double* b, double* x) {
  const HalfRow<rank> t = half_row<rank, is_even>(level, row, half, x);
  double squares = 0;
#pragma omp simd reduction(+ : squares)
  for (std::int64_t i = 0; i < t.count; ++i) {
    const double wanted = b[t.begin + i] + sum_of_neighbours<rank, is_even>(t, i);
    const double left = wanted - t.diagonal[i] * x[t.begin + i];
    squares += left * left;
    x[t.begin + i] = t.inverse[i] * wanted;
  }
  return squares;
}
template <int rank>
double smooth_counted(const LevelRows& level, const RowPlace& row, int half, const double* b, double* x) {
  return level.is_even ? smooth_and_count<rank, true>(level, row, half, b, x)
                       : smooth_and_count<rank, false>(level, row, half, b, x);
}

template <int rank>
void relax(const LevelRows& level, const RowPlace& row, int half, double factor, const double* b, const double* x,
           double* to) {
  over_cells<rank>(level, row, half, x, [=](const HalfRow<rank>& t, std::int64_t i, double sum) {
    const double here = x[t.begin + i];
    to[t.begin + i] = here + factor * t.inverse[i] * (b[t.begin + i] - t.diagonal[i] * here + sum);
  });
}

template <int rank>
void residual(const LevelRows& level, const RowPlace& row, int half, const double* b, const double* x, double* r) {
  over_cells<rank>(level, row, half, x, [=](const HalfRow<rank>& t, std::int64_t i, double sum) {
    r[t.begin + i] = b[t.begin + i] - t.diagonal[i] * x[t.begin + i] + sum;
  });
}

template <int rank, bool is_even>
double squares_of(const LevelRows& level, const RowPlace& row, int half, const double* b, const double* x) {
  const HalfRow<rank> t = half_row<rank, is_even>(level, row, half, x);
  double squares = 0;
#pragma omp simd reduction(+ : squares)
  for (std::int64_t i = 0; i < t.count; ++i) {
    const double left = b[t.begin + i] - t.diagonal[i] * x[t.begin + i] + sum_of_neighbours<rank, is_even>(t, i);
    squares += left * left;
  }
  return squares;
}
template <int rank>
double squared_residual(const LevelRows& level, const RowPlace& row, int half, const double* b, const double* x) {
  return level.is_even ? squares_of<rank, true>(level, row, half, b, x)
                       : squares_of<rank, false>(level, row, half, b, x);
}

template <int rank>
void multiply(const LevelRows& level, const RowPlace& row, int half, const double* x, double* y) {
  over_cells<rank>(level, row, half, x, [=](const HalfRow<rank>& t, std::int64_t i, double sum) {
    y[t.begin + i] = t.diagonal[i] * x[t.begin + i] - sum;
  });
}

void interleave(std::int64_t pairs, const double* even, const double* odd, double* both) {
#pragma omp simd
  for (std::int64_t i = 0; i < pairs; ++i) both[2 * i] = even[i], both[2 * i + 1] = odd[i];
}

template <int terms>
void sum_some(const RowSum& sum, int first, double* result) {
  const double* values[terms];
  double weights[terms];
  for (int k = 0; k < terms; ++k) values[k] = sum.values[first + k], weights[k] = sum.weights[first + k];
#pragma omp simd
  for (std::int64_t i = 0; i < sum.count; ++i) {
    double value = first == 0 ? 0 : result[i];
    for (int k = 0; k < terms; ++k) value += weights[k] * values[k][i];
    result[i] = value;
  }
}

void sum_rows(const RowSum& sum, double* result) {
  if (sum.terms == 0) {
    for (std::int64_t i = 0; i < sum.count; ++i) result[i] = 0;
  }
  for (int first = 0; first < sum.terms;) {
    const int left = sum.terms - first, now = left >= 4 ? 4 : left >= 2 ? 2 : 1;
    (now == 4 ? sum_some<4> : now == 2 ? sum_some<2> : sum_some<1>)(sum, first, result);
    first += now;
  }
}

void restrict_along(const RestrictedRow& given, double* coarse) {
  const RestrictedRow row = given;
#pragma omp simd
  for (std::int64_t i = 0; i < row.count; ++i)
    coarse[i] = row.weights[0][i] * row.odd[i - 1] + row.weights[1][i] * row.even[i] + row.weights[2][i] * row.odd[i] +
                row.weights[3][i] * row.even[i + 1];
}

void add_interpolated(const InterpolatedRow& given, double* x) {
  const InterpolatedRow row = given;
  const double *one = row.rows[0], *other = row.rows[1];
  const double *far_one = one + row.to_far, *far_other = other + row.to_far;
#pragma omp simd
  for (std::int64_t i = 0; i < row.count; ++i) {
    const double near = row.weights[0] * one[i] + row.weights[1] * other[i],
                 far = row.weights[0] * far_one[i] + row.weights[1] * far_other[i];
    x[i] += row.share[i] * (row.near[i] * near + row.far[i] * far);
  }
}

void take_share(std::int64_t count, const double* share, double* r) {
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) r[i] *= share[i];
}

RowKernels loops() {
  return {.scale = scale,
          .smooth = {smooth<1>, smooth<2>, smooth<3>},
          .smooth_counted = {smooth_counted<1>, smooth_counted<2>, smooth_counted<3>},
          .relax = {relax<1>, relax<2>, relax<3>},
          .residual = {residual<1>, residual<2>, residual<3>},
          .squared_residual = {squared_residual<1>, squared_residual<2>, squared_residual<3>},
          .multiply = {multiply<1>, multiply<2>, multiply<3>},
          .interleave = interleave,
          .sum = sum_rows,
          .restrict_along = restrict_along,
          .add_interpolated = add_interpolated,
          .take_share = take_share};
}

}  // namespace
}  // namespace dpde
