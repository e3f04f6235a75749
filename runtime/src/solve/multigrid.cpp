// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid.h"

#include <cmath>

namespace dpde {

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
    coarsest_->solve(coarsest_b_, coarsest_x_);
    return here.pack(coarsest_x_, x);
  }
  cycle_from(level, b, x, true);
}

void Multigrid::cycle_from(std::size_t level, const double* b, double* x, bool is_guess_zero, double* squares) {
  CycleLevel &here = levels_[level], &coarse = levels_[level + 1];
  here.descend(b, x, is_guess_zero, coarse);
  descend(level + 1, coarse.b.data(), coarse.x.data());
  here.ascend(b, x, is_symmetric_, coarse, squares);
}

double Multigrid::residual(std::span<const double> b, std::span<const double> x) const {
  return std::sqrt(levels_.front().squared_residual(b.data(), x.data()));
}

IterationReport Multigrid::iterate(std::span<const double> b, std::span<double> x, double tolerance, double rounding,
                                   int most) {
  CycleLevel& finest = levels_.front();
  const double size = norm(b);
  IterationReport report;
  double squares = finest.squared_residual(b.data(), x.data());
  for (;; ++report.iterations) {
    const double left = std::sqrt(squares);
    report.residual = size == 0 ? left : left / size;
    const bool is_near = report.residual <= 1e-7;  // before, |x| need not be known
    report.converged = report.residual <= tolerance || (is_near && left <= rounding * norm(x));
    if (report.converged || report.iterations == most || !std::isfinite(report.residual)) return report;
    if (levels_.size() == 1) {
      descend(0, b.data(), x.data());
      squares = finest.squared_residual(b.data(), x.data());
    } else {
      cycle_from(0, b.data(), x.data(), false, &squares);
    }
  }
}

}  // namespace dpde
