// SPDX-License-Identifier: Apache-2.0
// The loops of row_kernels.h; each source that includes this compiles them for another instruction set. Nothing in it
// has a name outside of the source, so that no other takes the code.
#pragma once

#include "solve/row_kernels.h"

namespace dpde {
namespace {

template <int rank>
inline double sum_of_neighbours(const RowTerms& t, std::int64_t i) {
  double sum = t.w[0][i] * t.x[0][i] + t.w[1][i] * t.x[1][i];
  if constexpr (rank > 1) sum += t.w[2][i] * t.x[2][i] + t.w[3][i] * t.x[3][i];
  if constexpr (rank > 2) sum += t.w[4][i] * t.x[4][i] + t.w[5][i] * t.x[5][i];
  return sum;
}

void scale(const RowTerms& terms, double* x) {
  const RowTerms t = terms;
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) x[i] = t.inverse[i] * t.b[i];
}

template <int rank>
void smooth(const RowTerms& terms, double* x) {
  const RowTerms t = terms;
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) x[i] = t.inverse[i] * (t.b[i] + sum_of_neighbours<rank>(t, i));
}

void scale_by(const RowTerms& terms, double factor, double* x) {
  const RowTerms t = terms;
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) x[i] = factor * t.inverse[i] * t.b[i];
}

template <int rank>
void relax(const RowTerms& terms, double factor, const double* x, double* to) {
  const RowTerms t = terms;
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i)
    to[i] = x[i] + factor * t.inverse[i] * (t.b[i] - t.diagonal[i] * x[i] + sum_of_neighbours<rank>(t, i));
}

template <int rank>
void residual(const RowTerms& terms, const double* x, double* r) {
  const RowTerms t = terms;
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) r[i] = t.b[i] - t.diagonal[i] * x[i] + sum_of_neighbours<rank>(t, i);
}

template <int rank>
double squared_residual(const RowTerms& terms, const double* x) {
  const RowTerms t = terms;
  double squares = 0;
#pragma omp simd reduction(+ : squares)
  for (std::int64_t i = 0; i < t.count; ++i) {
    const double left = t.b[i] - t.diagonal[i] * x[i] + sum_of_neighbours<rank>(t, i);
    squares += left * left;
  }
  return squares;
}

template <int rank>
void multiply(const RowTerms& terms, const double* x, double* y) {
  const RowTerms t = terms;
#pragma omp simd
  for (std::int64_t i = 0; i < t.count; ++i) y[i] = t.diagonal[i] * x[i] - sum_of_neighbours<rank>(t, i);
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
#pragma omp simd
  for (std::int64_t i = 0; i < row.count; ++i)
    x[i] += row.share[i] * (row.near[i] * row.at_near[i] + row.far[i] * row.at_far[i]);
}

void take_share(std::int64_t count, const double* share, double* r) {
#pragma omp simd
  for (std::int64_t i = 0; i < count; ++i) r[i] *= share[i];
}

RowKernels loops() {
  return {.scale = scale,
          .smooth = {smooth<1>, smooth<2>, smooth<3>},
          .scale_by = scale_by,
          .relax = {relax<1>, relax<2>, relax<3>},
          .residual = {residual<1>, residual<2>, residual<3>},
          .squared_residual = {squared_residual<1>, squared_residual<2>, squared_residual<3>},
          .multiply = {multiply<1>, multiply<2>, multiply<3>},
          .sum = sum_rows,
          .restrict_along = restrict_along,
          .add_interpolated = add_interpolated,
          .take_share = take_share};
}

}  // namespace
}  // namespace dpde
