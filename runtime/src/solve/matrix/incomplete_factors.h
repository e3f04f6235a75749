// SPDX-License-Identifier: Apache-2.0
// A sparse matrix by rows and its incomplete factors without fill-in, ILU(0) (Saad 2003, algorithm 10.4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace dpde {

class IncompleteFactors {
 public:
  /// `columns`: those of each row in ascending order, the diagonal included.
  explicit IncompleteFactors(const std::vector<std::vector<std::int64_t>>& columns);

  void set_zero();
  void set(std::int64_t row, std::int64_t column, double value);
  /// Returns false if a pivot is 0 or not finite.
  bool factor();
  void multiply(std::span<const double> x, std::span<double> result) const;
  void precondition(std::span<const double> right, std::span<double> x) const;
  /// Memory use.
  std::int64_t bytes() const { return static_cast<std::int64_t>(24 * values_.size() + 24 * diagonal_.size()); }

 private:
  std::size_t rows() const { return diagonal_.size(); }

  std::vector<std::size_t> begin_, diagonal_;
  std::vector<std::int64_t> columns_, place_in_row_;
  std::vector<double> values_, factors_;
};

}  // namespace dpde
