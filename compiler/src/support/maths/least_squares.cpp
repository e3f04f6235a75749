// SPDX-License-Identifier: Apache-2.0
#include "support/maths/least_squares.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace dpde {

namespace {

double norm(std::span<const double> x) {
  double sum = 0;
  for (const double value : x) sum += value * value;
  return std::sqrt(sum);
}

/// The reflection that zeroes x from `tail` on; the length moves to `head`.
Reflection reflection_of(std::span<const double> x, std::size_t head, std::size_t tail) {
  const double rest = norm(x.subspan(tail)), length = std::hypot(x[head], rest);
  if (rest == 0) return {head, tail, 0, 0, {}};
  const double first = x[head] + std::copysign(length, x[head]);
  const auto from = x.begin() + static_cast<std::ptrdiff_t>(tail);
  return {head, tail, first, 1 / (length * std::abs(first)), {from, x.end()}};
}

}  // namespace

void Reflection::apply(std::span<double> x) const {
  if (rest.empty()) return;
  double sum = first * x[head];
  for (std::size_t i = 0; i < rest.size(); ++i) sum += rest[i] * x[tail + i];
  sum *= factor;
  x[head] -= sum * first;
  for (std::size_t i = 0; i < rest.size(); ++i) x[tail + i] -= sum * rest[i];
}

PseudoInverse::PseudoInverse(DenseMatrix a, double threshold) : a_(std::move(a)), order_(a_.size) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  reduce_columns(threshold);
  reduce_rows();
}

/// Swaps the column with the largest remainder to position k.
void PseudoInverse::pivot(std::size_t k) {
  std::size_t largest = k;
  double most = 0;
  for (std::size_t j = k; j < a_.size; ++j) {
    const double left = norm(a_.column(j).subspan(k));
    if (left > most) largest = j;
    most = std::max(most, left);
  }
  std::ranges::swap_ranges(a_.column(k), a_.column(largest));
  std::swap(order_[k], order_[largest]);
}

void PseudoInverse::reduce_columns(double threshold) {
  double first = 0;
  for (std::size_t k = 0; k < a_.size; ++k) {
    pivot(k);
    const double left = norm(a_.column(k).subspan(k));
    if (k == 0) first = left;
    if (!(left > threshold * first)) break;
    left_.push_back(reflection_of(a_.column(k), k, k + 1));
    for (std::size_t j = k; j < a_.size; ++j) left_.back().apply(a_.column(j));
  }
}

/// Zeroes the rest of the rows to the right of the triangle, last row first.
void PseudoInverse::reduce_rows() {
  const std::size_t rank = left_.size();
  std::vector<double> row(a_.size);
  for (std::size_t k = rank; rank < a_.size && k-- > 0;) {
    for (std::size_t i = k + 1; i-- > 0;) {
      for (std::size_t j = 0; j < a_.size; ++j) row[j] = a_.column(j)[i];
      if (i == k) right_.push_back(reflection_of(row, k, rank));
      right_.back().apply(row);
      for (std::size_t j = 0; j < a_.size; ++j) a_.column(j)[i] = row[j];
    }
  }
}

std::vector<double> PseudoInverse::solve(std::vector<double> b) const {
  for (const Reflection& reflection : left_) reflection.apply(b);
  const std::size_t rank = left_.size();
  std::fill(b.begin() + static_cast<std::ptrdiff_t>(rank), b.end(), 0.0);
  for (std::size_t k = rank; k-- > 0;) {
    b[k] /= a_.column(k)[k];
    for (std::size_t i = 0; i < k; ++i) b[i] -= a_.column(k)[i] * b[k];
  }
  for (auto reflection = right_.rbegin(); reflection != right_.rend(); ++reflection) reflection->apply(b);
  std::vector<double> x(b.size());
  for (std::size_t k = 0; k < x.size(); ++k) x[order_[k]] = b[k];
  return x;
}

}  // namespace dpde
