// SPDX-License-Identifier: Apache-2.0
#include "solve/operator/grid_operator.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "solve/operator/vector_parts.h"
#include "solve/rows/row_products.h"

namespace dpde {
namespace {

double norm_of_largest_row(const ConstantRows& rows) { return rows.largest_row(); }

double norm_of_largest_row(const StencilMatrix& matrix) {
  const auto size = static_cast<std::size_t>(matrix.size());
  double most = 0;
  for (std::size_t row = 0; row < size; ++row) {
    double squares = 0;
    for (const std::vector<double>& column : matrix.values) squares += column[row] * column[row];
    most = std::max(most, squares);
  }
  return std::sqrt(most);
}

}  // namespace

GridOperator::GridOperator(StencilMatrix matrix, std::span<const double> sums, double rounding,
                           const OperatorKnowledge& known)
    : rows_(std::move(matrix)) {
  NullSpaceMemory memory;
  set_sums(sums, rounding, known, memory);
}

void GridOperator::set_sums(std::span<const double> sums, double rounding, const OperatorKnowledge& known,
                            NullSpaceMemory& memory) {
  auto& own = std::get<StencilMatrix>(rows_);
  is_known_symmetric_ = known.is_symmetric;
  balance(own, sums, rounding);
  null_space_.find(own, sums, rounding, known, memory);
}

GridOperator::GridOperator(StencilMatrix matrix, double rounding) : rows_(std::move(matrix)) {
  auto& own = std::get<StencilMatrix>(rows_);
  const std::vector<double> sums = row_sums(own, rounding);
  balance(own, sums, rounding);
  null_space_ = NullSpace(own, sums, rounding);
}

GridOperator::GridOperator(const ConstantRows& rows, const OperatorKnowledge& known)
    : rows_(rows), null_space_(rows), is_known_symmetric_(known.is_symmetric) {}

const std::array<std::int64_t, 3>& GridOperator::cells() const {
  const auto* const rows = constant_rows();
  return rows != nullptr ? rows->cells() : std::get<StencilMatrix>(rows_).cells;
}

StencilMatrix GridOperator::take_matrix() && {
  auto* const matrix = std::get_if<StencilMatrix>(&rows_);
  return matrix == nullptr ? StencilMatrix{} : std::move(*matrix);
}

void GridOperator::multiply(std::span<const double> x, std::span<double> result, const Team& team) const {
  visit([&](const auto& rows) {
    RowParts(cells()).for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t) {
      for_each_block_of(cells(), begin, end, [&](std::size_t number, const GridPlace& first, std::int64_t count) {
        multiply_cells(rows, first, count, x, result.data() + number);
      });
    });
  });
}

void GridOperator::multiply_transposed(std::span<const double> x, std::span<double> result) const {
  if (const ConstantRows* const rows = constant_rows()) {
    const ConstantRows transposed = rows->transposed();
    for_each_block(cells(), [&](std::size_t number, const GridPlace& first, std::int64_t count) {
      transposed.multiply_cells(first, count, x, result.data() + number);
    });
    return;
  }
  dpde::multiply_transposed(std::get<StencilMatrix>(rows_), x, result);
}

double GridOperator::residual(std::span<const double> b, std::span<const double> x, const Team& team) const {
  return visit([&](const auto& rows) {
    std::array<double, RowParts::most> squares{};
    const RowParts parts(cells());
    parts.for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t part) {
      double own = 0;
      for_each_left(rows, begin, end, b, x, [&](double left) { own += left * left; });
      squares[static_cast<std::size_t>(part)] = own;
    });
    return std::sqrt(std::accumulate(squares.begin(), squares.end(), 0.0));
  });
}

void GridOperator::residual_of_row(std::int64_t first, std::span<const double> b, std::span<const double> x,
                                   std::span<double> left) const {
  const auto row = static_cast<std::size_t>(first / cells()[0]);
  visit([&](const auto& rows) {
    double* to = left.data();
    for_each_left(rows, row, row + 1, b, x, [&](double value) { *to++ = value; });
  });
}

std::vector<double> GridOperator::diagonal() const {
  std::vector<double> result(static_cast<std::size_t>(size()), 0.0);
  if (const ConstantRows* const rows = constant_rows()) {
    for_each_cell(cells(), [&](std::size_t number, const GridPlace& cell) {
      rows->for_each_entry_of(cell, [&](std::size_t column, double value) {
        if (column == number) result[number] += value;
      });
    });
  } else {
    for_each_entry(std::get<StencilMatrix>(rows_), [&](std::size_t row, std::size_t column, double value) {
      if (row == column) result[row] += value;
    });
  }
  return result;
}

double GridOperator::largest_row() const {
  return visit([](const auto& rows) { return norm_of_largest_row(rows); });
}

bool GridOperator::is_symmetric(double rounding) const {
  return is_known_symmetric_ || visit([&](const auto& rows) { return dpde::is_symmetric(rows, rounding); });
}

}  // namespace dpde
