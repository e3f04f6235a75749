// SPDX-License-Identifier: Apache-2.0
// A linear operator on the cells of a grid and its null space: constant rows, which take no memory, or a row for each
// cell.
#pragma once

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "dpde/runtime/team.h"
#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"
#include "solve/rows/constant_rows.h"

namespace dpde {

class GridOperator {
 public:
  GridOperator() = default;
  /// `rounding`: relative error of the entries. Changes diagonals so that rows have the given `sums`.
  GridOperator(StencilMatrix matrix, std::span<const double> sums, double rounding,
               const OperatorKnowledge& known = {});
  /// The same in place, reusing memory; sums(matrix) returns the row sums.
  template <class F>
  void set(StencilMatrix matrix, const F& sums, double rounding, const OperatorKnowledge& known,
           NullSpaceMemory& memory) {
    rows_ = std::move(matrix);
    const auto& own = std::get<StencilMatrix>(rows_);
    set_sums(sums(own), rounding, known, memory);
  }
  /// For a matrix without further knowledge.
  GridOperator(StencilMatrix matrix, double rounding);
  /// For constant rows, whose sum is known.
  explicit GridOperator(const ConstantRows& rows, const OperatorKnowledge& known = {});

  const std::array<std::int64_t, 3>& cells() const;
  std::int64_t size() const { return cells()[0] * cells()[1] * cells()[2]; }
  const NullSpace& null_space() const { return null_space_; }
  /// Null unless the rows are known to be constant.
  const ConstantRows* constant_rows() const { return std::get_if<ConstantRows>(&rows_); }
  /// Calls `use`(rows) with ConstantRows or StencilMatrix.
  template <class F>
  auto visit(const F& use) const {
    return std::visit(use, rows_);
  }
  /// Calls `use`(matrix), which is made temporarily for constant rows.
  template <class F>
  auto with_matrix(const F& use) const {
    const auto* const matrix = std::get_if<StencilMatrix>(&rows_);
    return matrix != nullptr ? use(*matrix) : use(std::get<ConstantRows>(rows_).matrix());
  }
  /// Moves out the matrix, so that its memory can be reused.
  StencilMatrix take_matrix() &&;

  /// Both are bit-identical for any number of threads.
  void multiply(std::span<const double> x, std::span<double> result, const Team& team = 1) const;
  void multiply_transposed(std::span<const double> x, std::span<double> result) const;
  /// |b - A*x|; nothing is allocated.
  double residual(std::span<const double> b, std::span<const double> x, const Team& team = 1) const;
  /// b - A*x for the row of cells along x that begins with cell `first`.
  void residual_of_row(std::int64_t first, std::span<const double> b, std::span<const double> x,
                       std::span<double> left) const;
  std::vector<double> diagonal() const;
  double largest_row() const;  // norm
  bool is_known_symmetric() const { return is_known_symmetric_; }
  /// Known, or found from entries that are equal up to rounding.
  bool is_symmetric(double rounding) const;
  bool operator==(const GridOperator& other) const { return rows_ == other.rows_; }

 private:
  void set_sums(std::span<const double> sums, double rounding, const OperatorKnowledge& known, NullSpaceMemory& memory);

  std::variant<StencilMatrix, ConstantRows> rows_;
  NullSpace null_space_;
  bool is_known_symmetric_ = false;
};

}  // namespace dpde
