// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/coupled_waves.h"

#include <algorithm>

namespace dpde::stability {

namespace {

using Matrix = std::vector<std::vector<LinearForm>>;

/// `factor` is of component 0.
LinearForm product_of_forms(const LinearForm& factor, const LinearForm& form) {
  LinearForm sum;
  for (const LinearForm::Term& term : factor.terms())
    sum = sum.plus(form.shifted(LinearForm::offset_of(term.key)).times(term.coefficient));
  return sum;
}

Matrix without(const Matrix& matrix, std::size_t row, std::size_t column) {
  Matrix rest;
  for (std::size_t i = 0; i < matrix.size(); ++i) {
    if (i == row) continue;
    rest.push_back(matrix[i]);
    rest.back().erase(rest.back().begin() + static_cast<std::ptrdiff_t>(column));
  }
  return rest;
}

/// By expansion along the first row.
LinearForm determinant(const Matrix& matrix) {
  if (matrix.empty()) return LinearForm(0);
  LinearForm sum;
  for (std::size_t column = 0; column < matrix.size(); ++column) {
    if (matrix[0][column].is_zero()) continue;
    const LinearForm part = product_of_forms(matrix[0][column], determinant(without(matrix, 0, column)));
    sum = sum.plus(column % 2 == 0 ? part : part.times(-1));
  }
  return sum;
}

}  // namespace

std::vector<WaveSum> coupled_waves(const Matrix& matrix, const std::vector<LinearForm>& rights) {
  if (std::ranges::all_of(rights, &LinearForm::is_zero)) return {};
  const LinearForm divisor = determinant(matrix);
  std::vector<WaveSum> result;
  for (std::size_t unknown = 0; unknown < matrix.size(); ++unknown) {
    WaveSum sum{{}, divisor};
    for (std::size_t row = 0; row < matrix.size(); ++row) {
      if (rights[row].is_zero()) continue;
      const LinearForm part = product_of_forms(determinant(without(matrix, row, unknown)), rights[row]);
      sum.terms.push_back({(row + unknown) % 2 == 0 ? part : part.times(-1), WaveMultiplier::one()});
    }
    result.push_back(std::move(sum));
  }
  return result;
}

}  // namespace dpde::stability
