// SPDX-License-Identifier: Apache-2.0
#include "solve/operator/finite.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

/// Independent partial sums: additions do not wait for each other, and their order is the same on all machines.
constexpr std::size_t strands = 16;
using Strands = std::array<double, strands>;

/// Calls f(strand, value) for all values.
template <class Real, class F>
void in_strands(std::span<const Real> values, const F& f) {
  std::size_t i = 0;
  for (; i + strands <= values.size(); i += strands) {
#pragma omp simd
    for (std::size_t k = 0; k < strands; ++k) f(k, values[i + k]);
  }
  for (std::size_t k = 0; i < values.size(); ++i, ++k) f(k, values[i]);
}

bool are_squares_in_range(double largest) { return largest == 0 || (largest > 0x1p-400 && largest < 0x1p400); }

double total(const Strands& parts) {
  double sum = 0;
  for (const double part : parts) sum += part;
  return sum;
}

}  // namespace

bool are_finite(std::span<const double> values, const Team& team) {
  return sum_of_parts(team, values.size(), [&](std::size_t begin, std::size_t end) {
           Strands zeros{};
           in_strands(values.subspan(begin, end - begin), [&](std::size_t k, double value) { zeros[k] += 0 * value; });
           return total(zeros);
         }) == 0;
}

template <class Real>
bool is_finite_block(std::span<const Real> values) {
  std::array<Real, strands> zeros{};
  in_strands(values, [&](std::size_t k, Real value) { zeros[k] += 0 * value; });
  return std::ranges::all_of(zeros, [](Real zero) { return zero == 0; });
}
template bool is_finite_block(std::span<const double> values);
template bool is_finite_block(std::span<const float> values);

double factor_into_range(std::span<const double> values, const Team& team) {
  std::array<double, VectorParts::most> largest_of_parts{};
  std::array<double, VectorParts::most> zeros_of_parts{};
  VectorParts(values.size()).for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t part) {
    Strands zeros{}, most{};
    in_strands(values.subspan(begin, end - begin), [&](std::size_t k, double value) {
      const double size = std::abs(value);
      zeros[k] += 0 * value;
      most[k] = size > most[k] ? size : most[k];
    });
    zeros_of_parts[static_cast<std::size_t>(part)] = total(zeros);
    largest_of_parts[static_cast<std::size_t>(part)] = *std::ranges::max_element(most);
  });
  for (const double zero : zeros_of_parts) {
    if (zero != 0) return 0;
  }
  const double largest = *std::ranges::max_element(largest_of_parts);
  return are_squares_in_range(largest) ? 1 : std::exp2(std::clamp(-std::ilogb(largest), -1020, 1020));
}

void Extent::join(const Extent& other) {
  sums.sum += other.sums.sum;
  sums.squares += other.sums.squares;
  largest = std::max(largest, other.largest);
  is_finite = is_finite && other.is_finite;
}

template <>
bool Extent::is_in_range<double>() const {
  return is_finite && are_squares_in_range(largest);
}
template <>
bool Extent::is_in_range<float>() const {
  return is_finite && (largest == 0 || (largest > 0x1p-60 && largest < 0x1p60));
}

/// If a value is not finite, neither is the sum of squares.
template <class Real>
Extent extent_of(std::span<const Real> values) {
  Strands sums{}, squares{};
  std::array<Real, strands> most{};
  in_strands(values, [&](std::size_t k, Real value) {
    const Real size = std::abs(value);
    const double wide = value;
    sums[k] += wide;
    squares[k] += wide * wide;
    most[k] = size > most[k] ? size : most[k];
  });
  const double all = total(squares);
  return {{total(sums), all}, *std::ranges::max_element(most), std::isfinite(all)};
}
template Extent extent_of(std::span<const double> values);
template Extent extent_of(std::span<const float> values);

void multiply_all(std::span<double> values, double factor, const Team& team) {
  if (factor == 1) return;
  set_each(
      team, values, [factor](double value) { return factor * value; }, values);
}

Sums sums_of(std::span<const double> values, const Team& team) {
  std::array<Sums, VectorParts::most> made{};
  VectorParts(values.size()).for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t part) {
    Strands sums{}, squares{};
    in_strands(values.subspan(begin, end - begin), [&](std::size_t k, double value) {
      sums[k] += value;
      squares[k] += value * value;
    });
    made[static_cast<std::size_t>(part)] = {total(sums), total(squares)};
  });
  Sums all;
  for (const Sums& part : made) all.sum += part.sum, all.squares += part.squares;
  return all;
}

}  // namespace dpde
