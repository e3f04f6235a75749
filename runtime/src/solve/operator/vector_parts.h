// SPDX-License-Identifier: Apache-2.0
// Loops over vectors in parts, in parallel if there are enough numbers. Parts depend on the length alone, and sums
// combine the results of parts in order: results are bit-identical for any number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "dpde/runtime/team.h"

namespace dpde {

/// On fewer cells transforms and smoothers are faster on one thread: sharing costs 10 us.
constexpr std::int64_t least_cells_of_team = 16 * 1024;

class VectorParts {
 public:
  /// Fewer numbers are faster on one thread: sharing costs 10 us.
  static constexpr std::size_t least_shared = 32 * 1024;
  static constexpr std::int64_t most = 64;

  explicit VectorParts(std::size_t size) : size_(size) {
    const std::size_t length = (size + most - 1) / most;
    length_ = std::max<std::size_t>(4096, (length + 15) / 16 * 16);  // whole lines of the cache
  }
  std::int64_t count() const { return static_cast<std::int64_t>((size_ + length_ - 1) / length_); }

  /// Calls f(first index, end index, part) for each part.
  template <class F>
  void for_each(const Team& team, const F& f) const {
    const auto one = [&](std::int64_t part, int = 0) {
      const std::size_t begin = static_cast<std::size_t>(part) * length_;
      f(begin, std::min(begin + length_, size_), part);
    };
    if (size_ >= least_shared) return team.run(count(), one);
    for (std::int64_t part = 0; part < count(); ++part) one(part);
  }

 private:
  std::size_t size_, length_;
};

/// The same for the rows of a grid along x.
class RowParts {
 public:
  static constexpr std::int64_t most = VectorParts::most;

  explicit RowParts(const std::array<std::int64_t, 3>& cells)
      : rows_(static_cast<std::size_t>(cells[1] * cells[2])),
        length_((rows_ + most - 1) / most),
        is_shared_(cells[0] * cells[1] * cells[2] >= static_cast<std::int64_t>(VectorParts::least_shared)) {}

  /// Calls f(first row, end row, part) for each part.
  template <class F>
  void for_each(const Team& team, const F& f) const {
    const auto count = static_cast<std::int64_t>((rows_ + length_ - 1) / length_);
    const auto one = [&](std::int64_t part, int = 0) {
      const std::size_t begin = static_cast<std::size_t>(part) * length_;
      f(begin, std::min(begin + length_, rows_), part);
    };
    if (is_shared_) return team.run(count, one);
    for (std::int64_t part = 0; part < count; ++part) one(part);
  }

 private:
  std::size_t rows_, length_;
  bool is_shared_;
};

/// to_i = f(elements i of `from`); a `from` may be `to`.
template <class F, class... From>
void set_each(const Team& team, std::span<double> to, const F& f, const From&... from) {
  const auto one = [&](std::size_t begin, std::size_t end, double* result, const auto*... values) {
#pragma omp simd
    for (std::size_t i = begin; i < end; ++i) result[i] = f(values[i]...);
  };
  VectorParts(to.size()).for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t) {
    one(begin, end, to.data(), std::span<const double>(from).data()...);
  });
}

/// The sum of f(first index, end index) over the parts.
template <class F>
double sum_of_parts(const Team& team, std::size_t size, const F& f) {
  std::array<double, VectorParts::most> made;
  const VectorParts parts(size);
  parts.for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t part) {
    made[static_cast<std::size_t>(part)] = f(begin, end);
  });
  double sum = 0;
  for (std::int64_t part = 0; part < parts.count(); ++part) sum += made[static_cast<std::size_t>(part)];
  return sum;
}

/// Subtracts from the elements with these indices their mean, and returns it.
template <class Real>
double remove_mean(const Team& team, std::span<Real> values, std::span<const std::uint32_t> numbers) {
  if (numbers.size() == 1) return std::exchange(values[numbers.front()], Real(0));
  const double sum = sum_of_parts(team, numbers.size(), [&](std::size_t begin, std::size_t end) {
    double of_part = 0;
    for (const std::uint32_t number : numbers.subspan(begin, end - begin)) of_part += values[number];
    return of_part;
  });
  const double mean = sum / static_cast<double>(numbers.size());
  VectorParts(numbers.size()).for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t) {
    for (const std::uint32_t number : numbers.subspan(begin, end - begin)) values[number] -= static_cast<Real>(mean);
  });
  return mean;
}

}  // namespace dpde
