// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid.h"

#include <cmath>

#include "solve/finite.h"
#include "solve/vector_parts.h"

namespace dpde {
namespace {

constexpr double usual_rate = 0.01;  // of |b - A*x|^2 in one cycle, before one is made

}  // namespace

void Multigrid::pack_right(std::span<const double> b, std::span<double> vector) const {
  levels_.front().pack_right(b, sign_, vector.data());
}
void Multigrid::pack(std::span<const double> x, std::span<double> vector) const {
  levels_.front().pack(x, vector.data());
}
void Multigrid::unpack(std::span<const double> vector, std::span<double> x) const {
  levels_.front().unpack(vector.data(), x);
}

void Multigrid::descend(std::size_t level, const double* b, double* x) {
  CycleLevel& here = levels_[level];
  if (level + 1 == levels_.size()) {
    here.unpack(b, coarsest_b_);
    coarsest_.solve(coarsest_b_, coarsest_x_);
    return here.pack(coarsest_x_, x);
  }
  CycleLevel& coarse = levels_[level + 1];
  here.descend(b, x, true, coarse);
  descend(level + 1, coarse.b.data(), coarse.x.data());
  here.ascend(b, x, options_.is_symmetric, coarse);
}

void Multigrid::multiply(std::span<const double> x, std::span<double> y) const {
  levels_.front().multiply(x.data(), y.data());
  if (singular_cells_ > 0) {
    const double sum = sums_of(y, team_).sum;  // the rooms of images are 0
    levels_.front().subtract(sum / static_cast<double>(singular_cells_), y.data());
  }
  for (const std::vector<std::uint32_t>& part : singular_parts_) remove_mean(team_, y, part);
}

void Multigrid::know_null_space(const NullSpace& null_space) {
  const CycleLevel& finest = levels_.front();
  singular_cells_ = 0;
  singular_parts_.clear();
  for (const std::vector<std::uint32_t>& part : null_space.parts()) {
    if (part.size() == finest.cell_count()) singular_cells_ = part.size();
    if (part.size() == finest.cell_count() || part.size() == 1) continue;  // the image of a cell alone is 0
    singular_parts_.push_back(finest.places_of(part));
  }
}

double Multigrid::residual(std::span<const double> b, std::span<const double> x) {
  return std::sqrt(levels_.front().squared_residual(b.data(), x.data()));
}

/// Where another cycle is sure to follow, as far as the one before tells, the finest level goes up and down at once.
IterationReport Multigrid::iterate(std::span<const double> b, std::span<double> x, double tolerance, double rounding,
                                   int most) {
  CycleLevel& finest = levels_.front();
  const double size = norm(b, team_);
  IterationReport report;
  double squares = finest.squared_residual(b.data(), x.data()), rate = usual_rate;
  for (bool has_descended = false;; ++report.iterations) {
    const double left = std::sqrt(squares);
    report.residual = size == 0 ? left : left / size;
    const bool is_near = report.residual <= 1e-7;  // before, |x| need not be known
    report.converged = report.residual <= tolerance || (is_near && left <= rounding * norm(x, team_));
    if (report.converged || report.iterations == most || !std::isfinite(report.residual)) return report;
    if (levels_.size() == 1) {
      descend(0, b.data(), x.data());
      squares = finest.squared_residual(b.data(), x.data());
      continue;
    }
    if (!has_descended) finest.descend(b.data(), x.data(), false, levels_[1]);
    descend(1, levels_[1].b.data(), levels_[1].x.data());
    const double before = squares;
    has_descended = report.iterations + 1 < most && report.residual * std::sqrt(rate) > tolerance;
    if (has_descended) {
      squares = finest.ascend_and_descend(b.data(), x.data(), levels_[1]);
    } else {
      finest.ascend(b.data(), x.data(), options_.is_symmetric, levels_[1], &squares);
    }
    rate = squares / before;
  }
}

}  // namespace dpde
