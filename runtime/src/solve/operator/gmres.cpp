// SPDX-License-Identifier: Apache-2.0
#include "solve/operator/gmres.h"

#include <algorithm>
#include <cmath>

#include "solve/operator/vector_parts.h"

namespace dpde {

void Gmres::resize(std::size_t size) {
  restart_ = std::max(1, std::min(restart_, static_cast<int>(std::min<std::size_t>(size, 1u << 20))));
  const auto count = static_cast<std::size_t>(restart_) + 1;
  basis_.clear();
  for (std::size_t i = 0; i < count; ++i) basis_.emplace_back(size);
  searched_.clear();
  for (std::size_t i = 0; is_flexible_ && i + 1 < count; ++i) searched_.emplace_back(size);
  work_ = Numbers(size);
  before_ = Numbers(size);
  upper_.assign(count * count, 0.0);
  for (auto* values : {&cosine_, &sine_, &right_}) values->assign(count, 0.0);
}

/// Computes the residual in the first vector; returns its norm.
double Gmres::find_residual(std::span<const double> b, std::span<const double> x) {
  Numbers& left = basis_.front();
  multiply_(x, left);
  set_each(
      team_, left, [](double right, double image) { return right - image; }, b, left);
  return norm(left);
}

IterationReport Gmres::solve(std::span<const double> b, std::span<double> x) {
  const double size = norm(b), unit = size == 0 ? 1 : size;
  IterationReport report;
  is_plain_ = false;
  unaided_ = 0;
  double left = find_residual(b, x);
  for (;;) {
    report.residual = left / unit;
    report.unaided = unaided_;
    report.converged = report.residual <= tolerance_;
    if (report.converged || report.iterations >= most_) return report;
    copy_vector(x, before_, team_);
    const int count = make_basis(left, 0.5 * tolerance_ * size, most_ - report.iterations);
    report.iterations += count;
    correct(count, x);
    const double now = find_residual(b, x);
    const bool goes_on = now < 0.5 * left || (is_flexible_ && !is_plain_);
    is_plain_ = is_flexible_ && (is_plain_ || !(now < 0.5 * left));
    if (!(now < left)) {
      copy_vector(before_, x, team_);
      if (!goes_on) return report;
      left = find_residual(b, x);
      continue;
    }
    left = now;
    if (goes_on) continue;
    report.residual = left / unit;
    report.converged = report.residual <= tolerance_;
    return report;
  }
}

/// Builds the basis from the residual in the first vector, of norm `left`; returns the number of directions.
int Gmres::make_basis(double left, double enough, int most) {
  set_each(
      team_, basis_.front(), [left](double value) { return value / left; }, basis_.front());
  std::ranges::fill(right_, 0.0);
  right_.front() = left;
  const int limit = std::min(most, restart_);
  for (int count = 0; count < limit;) {
    const auto j = static_cast<std::size_t>(count);
    const bool is_new = add_direction(j);
    rotate(j);
    ++count;
    if (!is_new || !(std::abs(right_[j + 1]) > enough)) return count;
  }
  return limit;
}

/// Computes M*v_j. Results of a flexible M are stored; if the preconditioner is given up, it is v_j.
const Numbers& Gmres::search(std::size_t j) {
  Numbers& made = is_flexible_ ? searched_[j] : work_;
  if (!is_plain_) precondition_(basis_[j], made);
  const bool is_found = is_flexible_ && !is_plain_;
  const double size = is_found ? norm(made) : 1;
  if (is_found && project_) project_(made, made);
  const double rounding = std::sqrt(static_cast<double>(made.size())) * 0x1p-52, left = is_found ? norm(made) : 1;
  if (is_plain_ || !(left > rounding * size && std::isfinite(left))) {
    copy_vector(basis_[j], made, team_);
    ++unaided_;
  }
  return made;
}

/// Adds A*M*v_j, orthogonalised by modified Gram-Schmidt; returns whether more than rounding is left.
bool Gmres::add_direction(std::size_t j) {
  const Numbers& along = search(j);
  Numbers& next = basis_[j + 1];
  multiply_(along, next);
  const double size = norm(next);
  for (std::size_t i = 0; i <= j; ++i) {
    upper(i, j) = dot(basis_[i], next);
    add_multiple(-upper(i, j), basis_[i], next, team_);
  }
  const double left = norm(next);
  const bool is_new = left > nothing_ * size;
  upper(j + 1, j) = is_new ? left : 0;
  if (is_new)
    set_each(
        team_, next, [left](double value) { return value / left; }, next);
  return is_new;
}

/// Eliminates the last entry of the new column by Givens rotations: |right[j + 1]| is the residual norm.
void Gmres::rotate(std::size_t j) {
  for (std::size_t i = 0; i < j; ++i) {
    const double above = upper(i, j), below = upper(i + 1, j);
    upper(i, j) = cosine_[i] * above + sine_[i] * below;
    upper(i + 1, j) = cosine_[i] * below - sine_[i] * above;
  }
  const double length = std::hypot(upper(j, j), upper(j + 1, j));
  cosine_[j] = length == 0 ? 1 : upper(j, j) / length;
  sine_[j] = length == 0 ? 0 : upper(j + 1, j) / length;
  upper(j, j) = length;
  right_[j + 1] = -sine_[j] * right_[j];
  right_[j] *= cosine_[j];
}

/// x += M*V*y, with y from the triangular system (flexible M: with the stored results). Components that a singular
/// operator does not determine stay 0.
void Gmres::correct(int count, std::span<double> x) {
  const auto n = static_cast<std::size_t>(count);
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, std::abs(upper(i, i)));
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) right_[i] -= upper(i, k) * right_[k];
    right_[i] = std::abs(upper(i, i)) <= nothing_ * largest ? 0 : right_[i] / upper(i, i);
  }
  for (std::size_t i = 0; is_flexible_ && i < n; ++i) add_multiple(right_[i], searched_[i], x, team_);
  if (is_flexible_) return;
  Numbers& sum = basis_[n];  // the last one is no longer needed
  set_each(team_, sum, [] { return 0.0; });
  for (std::size_t i = 0; i < n; ++i) add_multiple(right_[i], basis_[i], sum, team_);
  precondition_(sum, work_);
  add_multiple(1, work_, x, team_);
}

}  // namespace dpde
