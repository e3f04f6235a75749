// SPDX-License-Identifier: Apache-2.0
// Multigrid with float levels, for operators and vectors of doubles: half the memory and half the traffic. Used alone
// it is iterative refinement (Wilkinson 1963; for multigrid: Goeddeke, Strzodka and Turek 2007): cycles solve A*e = b -
// A*x in floats, then x += e, and the new residual is computed by the operator itself in doubles. So x becomes as
// accurate as with cycles in doubles.
//
// After a correction the residual contains rounding of e, about 2^-24*|A|*|e|. For long waves on large grids, or for
// coefficients with jumps, this may exceed the previous residual. It then consists of the shortest waves, in cells with
// large coefficients, and the next correction removes it: each one leaves a part 2^-24*sqrt(cond(A)) of the energy norm
// (e, A*e).
#pragma once

#include <optional>
#include <span>
#include <string>

#include "solve/multigrid/multigrid.h"
#include "solve/operator/grid_operator.h"

namespace dpde {

class FloatCycles {
 public:
  /// As Multigrid::of, or of_symmetric_part if `is_part`. Empty, with the reason in `why`, if the operator has another
  /// form, has numbers outside of the range of floats, or is so small that there is only one level.
  static std::optional<FloatCycles> of(const GridOperator& a, bool is_part, const MultigridOptions& options,
                                       std::string& why);
  /// As Multigrid::renew.
  bool renew(const StencilMatrix& matrix, const NullSpace& null_space, bool is_known_symmetric) {
    return cycles_.renew(matrix, null_space, is_known_symmetric);
  }
  SmootherKind smoother() const { return cycles_.smoother(); }

  /// One cycle: z is about A^-1*r. Nothing is allocated, here and below. Call begin() before the cycles of a solve,
  /// whose residuals must stay below |b| times some powers of ten.
  void begin(std::span<const double> b);
  void precondition(std::span<const double> r, std::span<double> z);
  /// Iterates until |b - A*x|, in doubles, is at most tolerance*|b|, or `rounding`*|x|; gives up after three successive
  /// corrections that reduce it by less than a factor of 10. `most`: cycles.
  IterationReport solve(const GridOperator& a, std::span<const double> b, std::span<double> x, double tolerance,
                        double rounding, int most);

 private:
  FloatCycles(MultigridOf<float> cycles, const Team& team);

  MultigridOf<float> cycles_;
  Team team_;
  double factor_ = 1;  // scale of right sides
  NumbersOf<float> right_, made_;
};

}  // namespace dpde
