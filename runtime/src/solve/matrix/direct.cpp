// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/direct.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dpde/runtime/error.h"
#include "solve/matrix/held_cells.h"

namespace dpde {
namespace {

constexpr std::int64_t most_dense = 1500;

}  // namespace

DirectSolver::DirectSolver(const StencilMatrix& matrix, const NullSpace& null_space, double rounding)
    : is_dense_(null_space.is_lopsided()) {
  const std::int64_t cells = matrix.size();
  if (is_dense_) {
    if (cells > most_dense)
      throw Error(
          ErrorKind::run,
          "the operator is singular and not symmetric (its rows sum to 0 and its columns do not, or the other way "
          "round), which is solved up to 1500 cells only: write it in the form of fluxes");
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(cells, cells);
    for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
      dense(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) += value;
    });
    inverse_.setThreshold(std::max(64 * 0x1p-52 * static_cast<double>(cells), 8 * rounding));
    inverse_.compute(dense);
    return;
  }
  auto [cells_left, sparse] = without_held_cells(matrix, null_space);
  free_ = std::move(cells_left);
  places_.assign(static_cast<std::size_t>(cells), -1);
  for (std::size_t i = 0; i < free_.size(); ++i) places_[free_[i]] = static_cast<std::int64_t>(i);
  entries_ = entries_of(matrix);
  if (free_.empty()) return;
  right_.resize(sparse.rows());
  solution_.resize(sparse.rows());
  factors_.emplace(sparse);
  if (!factors_->factor() || is_singular(factors_->largest_column()))
    throw Error(ErrorKind::run, "the operator is singular: some right sides have no solution, others many");
}

bool DirectSolver::holds_as_before(const NullSpace& null_space) const {
  return null_space.parts().size() == places_.size() - free_.size() &&
         std::ranges::all_of(null_space.parts(), [&](const auto& part) { return places_[part.front()] < 0; });
}

/// Number of nonzero entries in equations that are not fixed; these decide the order of columns.
std::int64_t DirectSolver::entries_of(const StencilMatrix& matrix) const {
  std::int64_t count = 0;
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double) {
    if (places_[row] >= 0 && places_[column] >= 0) ++count;
  });
  return count;
}

bool DirectSolver::renew(const StencilMatrix& matrix, const NullSpace& null_space) {
  if (is_dense_ || null_space.is_lopsided() || !holds_as_before(null_space)) return false;
  if (entries_of(matrix) != entries_) return false;
  if (free_.empty()) return true;
  factors_->set_zero();
  bool are_there = true;
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
    if (places_[row] < 0 || places_[column] < 0) return;
    double* const entry = factors_->entry(places_[row], places_[column]);
    are_there = are_there && entry != nullptr;
    if (entry != nullptr) *entry += value;
  });
  return are_there && factors_->factor() && !is_singular(factors_->largest_column());
}

void DirectSolver::solve_by_factors() {
  factors_->solve({right_.data(), free_.size()}, {solution_.data(), free_.size()});
}

/// Two steps of inverse iteration: for a singular matrix each enlarges the vector by about 1/(smallest singular value),
/// more than rounding of the entries allows.
bool DirectSolver::is_singular(double size) {
  constexpr double most = 3e14;
  for (Eigen::Index i = 0; i < right_.size(); ++i) right_[i] = 1 + 0.5 * std::sin(static_cast<double>(i * i));
  for (int turn = 0; turn < 2; ++turn) {
    right_ /= right_.norm();
    solve_by_factors();
    if (!solution_.allFinite() || solution_.norm() * size > most) return true;
    right_ = solution_;
  }
  return false;
}

void DirectSolver::solve(std::span<const double> b, std::span<double> x) {
  if (is_dense_) {
    const auto size = static_cast<Eigen::Index>(b.size());
    Eigen::Map<Eigen::VectorXd>(x.data(), size) = inverse_.solve(Eigen::Map<const Eigen::VectorXd>(b.data(), size));
    return;
  }
  std::ranges::fill(x, 0.0);
  if (free_.empty()) return;
  for (std::size_t i = 0; i < free_.size(); ++i) right_[static_cast<Eigen::Index>(i)] = b[free_[i]];
  solve_by_factors();
  for (std::size_t i = 0; i < free_.size(); ++i) x[free_[i]] = solution_[static_cast<Eigen::Index>(i)];
}

}  // namespace dpde
