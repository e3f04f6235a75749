// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid/multigrid.h"

#include <cmath>
#include <type_traits>

#include "solve/operator/finite.h"
#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

constexpr double usual_rate = 0.01;  // assumed factor of |b - A*x|^2 for a cycle, until one was made

template <class Real>
double size_of(std::span<const Real> values, const Team& team) {
  if constexpr (std::is_same_v<Real, double>) return norm(values, team);
  return std::sqrt(sum_of_parts(team, values.size(), [&](std::size_t begin, std::size_t end) {
    double squares = 0;
#pragma omp simd reduction(+ : squares)
    for (std::size_t i = begin; i < end; ++i) squares += static_cast<double>(values[i]) * values[i];
    return squares;
  }));
}
template <class Real>
double sum_of(std::span<const Real> values, const Team& team) {
  if constexpr (std::is_same_v<Real, double>) return sums_of(values, team).sum;
  return sum_of_parts(team, values.size(), [&](std::size_t begin, std::size_t end) {
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (std::size_t i = begin; i < end; ++i) sum += values[i];
    return sum;
  });
}

}  // namespace

template <class Real>
void MultigridOf<Real>::pack_right(std::span<const double> b, double factor, std::span<Real> vector) const {
  levels_.front().pack_right(b, sign_ * factor, vector.data());
}
template <class Real>
double MultigridOf<Real>::pack_rows(const ReadRowsOf<double>& b, double factor, std::span<Real> vector) {
  const Sums sums = levels_.front().pack_rows(b, sign_ * factor, vector.data());
  if (singular_cells_ == 0 && singular_parts_.empty()) return factor * std::sqrt(sums.squares);
  if (singular_cells_ > 0) {
    const double mean = sums.sum / static_cast<double>(singular_cells_);
    levels_.front().subtract(static_cast<Real>(sign_ * factor * mean), vector.data());
  }
  for (const std::vector<std::uint32_t>& part : singular_parts_) remove_mean(team_, vector, part);
  return size_of<Real>(vector, team_);
}
template <class Real>
void MultigridOf<Real>::pack(std::span<const double> x, std::span<Real> vector) const {
  levels_.front().pack(x, 1, vector.data());
}
template <class Real>
void MultigridOf<Real>::unpack(std::span<const Real> vector, double factor, bool is_added, std::span<double> x) const {
  levels_.front().unpack(vector.data(), factor * scale_, is_added, x);
}

template <class Real>
void MultigridOf<Real>::descend(std::size_t level, const Real* b, Real* x) {
  CycleLevel<Real>& here = levels_[level];
  if (level + 1 == levels_.size()) {
    here.unpack(b, 1, false, coarsest_b_);
    coarsest_.solve(coarsest_b_, coarsest_x_);
    return here.pack(coarsest_x_, 1 / scale_, x);
  }
  CycleLevel<Real>& coarse = levels_[level + 1];
  here.descend(b, x, true, coarse);
  descend(level + 1, coarse.b.data(), coarse.x.data());
  here.ascend(b, x, options_.is_symmetric, coarse);
}

template <class Real>
void MultigridOf<Real>::multiply(std::span<const Real> x, std::span<Real> y) const {
  levels_.front().multiply(x.data(), y.data());
  if (singular_cells_ > 0) {
    const double sum = sum_of<Real>(y, team_);  // the extra spaces of images are 0
    levels_.front().subtract(static_cast<Real>(sum / static_cast<double>(singular_cells_)), y.data());
  }
  for (const std::vector<std::uint32_t>& part : singular_parts_) remove_mean(team_, y, part);
}

template <class Real>
void MultigridOf<Real>::know_null_space(const NullSpace& null_space) {
  const CycleLevel<Real>& finest = levels_.front();
  singular_cells_ = 0;
  singular_parts_.clear();
  for (const std::vector<std::uint32_t>& part : null_space.parts()) {
    if (part.size() == finest.cell_count()) singular_cells_ = part.size();
    if (part.size() == finest.cell_count() || part.size() == 1) continue;  // the image of an isolated cell is 0
    singular_parts_.push_back(finest.places_of(part));
  }
}

template <class Real>
double MultigridOf<Real>::residual(std::span<const Real> b, std::span<const Real> x) {
  return std::sqrt(levels_.front().squared_residual(b.data(), x.data()));
}

template <class Real>
IterationReport MultigridOf<Real>::iterate(std::span<const Real> b, std::span<Real> x, double tolerance,
                                           double rounding, int most) {
  const double before = levels_.front().squared_residual(b.data(), x.data());
  return go_on(b, x, {tolerance, rounding, size_of<Real>(b, team_), before, most, false});
}

template <class Real>
IterationReport MultigridOf<Real>::iterate_from_zero(std::span<const Real> b, double size, std::span<Real> x,
                                                     double tolerance, int most) {
  return go_on(b, x, {tolerance, 0, size, size * size, most, true});
}

/// Doubles: `rounding` is that of images relative to |x|; |x| is computed only once the residual is small. Floats:
/// stops if a cycle reduces the residual by less than a third: it is then rounding, or the cycles do not work.
template <class Real>
bool MultigridOf<Real>::is_at_end(std::span<const Real> x, const Goal& goal, double left, double before) const {
  if constexpr (has_differences<Real>) {
    return left > 0.7 * before;
  } else {
    const bool is_near = left <= 1e-7 * (goal.size == 0 ? 1 : goal.size);
    return is_near && left <= goal.rounding * norm(x, team_);
  }
}

/// If the previous reduction implies that another cycle follows, the finest level ascends and descends in one pass.
template <class Real>
IterationReport MultigridOf<Real>::go_on(std::span<const Real> b, std::span<Real> x, const Goal& goal) {
  CycleLevel<Real>& finest = levels_.front();
  IterationReport report;
  double squares = goal.squares, rate = usual_rate, before = INFINITY;
  for (bool has_descended = false;; ++report.iterations) {
    const double left = std::sqrt(squares);
    report.residual = goal.size == 0 ? left : left / goal.size;
    report.converged = report.residual <= goal.tolerance || is_at_end(x, goal, left, std::sqrt(before));
    if (report.converged || report.iterations == goal.most || !std::isfinite(report.residual)) return report;
    if (levels_.size() == 1) {
      descend(0, b.data(), x.data());
      squares = finest.squared_residual(b.data(), x.data());
      continue;
    }
    if (!has_descended) {
      const bool is_guess_zero = goal.is_guess_zero && report.iterations == 0;
      finest.descend(b.data(), x.data(), is_guess_zero, levels_[1]);
    }
    descend(1, levels_[1].b.data(), levels_[1].x.data());
    before = squares;
    has_descended = report.iterations + 1 < goal.most && report.residual * std::sqrt(rate) > goal.tolerance;
    if (has_descended) {
      squares = finest.ascend_and_descend(b.data(), x.data(), levels_[1]);
    } else {
      finest.ascend(b.data(), x.data(), options_.is_symmetric, levels_[1], &squares);
    }
    rate = squares / before;
  }
}

template class MultigridOf<double>;
template class MultigridOf<float>;

}  // namespace dpde
