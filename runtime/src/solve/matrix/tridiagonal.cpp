// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/tridiagonal.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dpde {

std::optional<TridiagonalSolver> TridiagonalSolver::of(const StencilMatrix& matrix, const NullSpace& null_space) {
  TridiagonalSolver solver;
  return solver.set(matrix, null_space) ? std::optional(std::move(solver)) : std::nullopt;
}

bool TridiagonalSolver::set(const StencilMatrix& matrix, const NullSpace& null_space) {
  const auto n = static_cast<std::size_t>(matrix.size());
  const bool is_one_part =
      null_space.is_empty() || (null_space.parts().size() == 1 && null_space.parts().front().size() == n);
  if (static_cast<std::int64_t>(n) != matrix.cells[0] || n < 3 || !is_one_part || null_space.is_lopsided())
    return false;
  std::vector<double>&lower = lower_, &diagonal = diagonal_, &upper = upper_;
  for (std::vector<double>* entries : {&lower, &diagonal, &upper}) entries->assign(n, 0.0);
  bool fits = true;
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
    if (column == row) {
      diagonal[row] += value;
    } else if (column == (row + 1) % n) {
      upper[row] += value;
    } else if (row == (column + 1) % n) {
      lower[row] += value;
    } else {
      fits = false;
    }
  });
  if (!null_space.is_empty()) {  // the first cell is fixed to 0
    upper[n - 1] = lower[0] = upper[0] = lower[1] = 0;
    diagonal[0] = diagonal[n / 2] == 0 ? 1 : diagonal[n / 2];
  }
  for (std::size_t i = 0; i < n; ++i)
    fits = fits && diagonal[i] != 0 && std::abs(diagonal[i]) >= 0.999999 * (std::abs(lower[i]) + std::abs(upper[i]));
  if (!fits) return false;
  holds_first_ = !null_space.is_empty();
  const double first = lower[0], last = upper[n - 1];
  is_ring_ = first != 0 || last != 0;
  if (is_ring_) {
    // A = T + u*v^T with u = (-d, 0, ..., last) and v = (1, 0, ..., -first/d), d = diagonal[0].
    const double d = diagonal[0];
    ring_first_ = 1;
    ring_last_ = -first / d;
    diagonal[0] += d;
    diagonal[n - 1] += first * last / d;
    ring_.assign(n, 0.0);
    ring_.front() = -d;
    ring_.back() = last;
  }
  lower[0] = upper[n - 1] = 0;
  pivot_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double pivot = diagonal[i] - (i > 0 ? lower[i] * pivot_[i - 1] * upper[i - 1] : 0);
    if (std::abs(pivot) <= 1e-13 * std::abs(diagonal[i])) return false;
    pivot_[i] = 1 / pivot;
  }
  if (is_ring_) {
    eliminate(ring_);
    const double scale = 1 + ring_first_ * ring_.front() + ring_last_ * ring_.back();
    if (std::abs(scale) < 1e-13) return false;
    ring_scale_ = 1 / scale;
  }
  return true;
}

void TridiagonalSolver::eliminate(std::span<double> x) const {
  const std::size_t n = x.size();
  for (std::size_t i = 1; i < n; ++i) x[i] -= lower_[i] * pivot_[i - 1] * x[i - 1];
  x[n - 1] *= pivot_[n - 1];
  for (std::size_t i = n - 1; i-- > 0;) x[i] = (x[i] - upper_[i] * x[i + 1]) * pivot_[i];
}

void TridiagonalSolver::solve(std::span<const double> b, std::span<double> x) const {
  std::ranges::copy(b, x.begin());
  if (holds_first_) x[0] = 0;
  eliminate(x);
  if (!is_ring_) return;
  const double amount = (ring_first_ * x.front() + ring_last_ * x.back()) * ring_scale_;
  for (std::size_t i = 0; i < x.size(); ++i) x[i] -= amount * ring_[i];
}

}  // namespace dpde
