// SPDX-License-Identifier: Apache-2.0
// Multigrid whose levels are floats, for operators and vectors of doubles: half the memory, and half of what a cycle
// reads. Alone it is iterative refinement (Wilkinson 1963; of multigrid: Goeddeke, Strzodka and Turek 2007): cycles of
// A*e = b - A*x in floats as far as these come, then x += e and b - A*x by the operator itself, in doubles. So x comes
// as near as cycles in doubles take it.
//
// What floats leave of b - A*x is rounding of e, about 2^-24*|A|*|e|: of long waves in large grids, or where
// coefficients jump, that may be more than b - A*x was. It is of the shortest waves then, in cells with large
// coefficients, and the next correction takes it away: of the error's energy (e, A*e) each leaves 2^-24*sqrt(cond(A)).
#pragma once

#include <optional>
#include <span>
#include <string>

#include "solve/multigrid/multigrid.h"
#include "solve/operator/grid_operator.h"

namespace dpde {

class FloatCycles {
 public:
  /// As Multigrid::of, or of_symmetric_part where `is_part`. Nothing where the operator has another form, has numbers
  /// that floats have not, or is so small that there is one level: `why`.
  static std::optional<FloatCycles> of(const GridOperator& a, bool is_part, const MultigridOptions& options,
                                       std::string& why);
  /// As Multigrid::renew.
  bool renew(const StencilMatrix& matrix, const NullSpace& null_space, bool is_known_symmetric) {
    return cycles_.renew(matrix, null_space, is_known_symmetric);
  }
  SmootherKind smoother() const { return cycles_.smoother(); }

  /// One cycle: z is about A^-1*r. Nothing is allocated, here and below. begin(): before those of a solve, whose
  /// residuals are to be less than |b| times some powers of ten.
  void begin(std::span<const double> b);
  void precondition(std::span<const double> r, std::span<double> z);
  /// Until |b - A*x|, in doubles, is at most the tolerance times |b|, or `rounding` times |x|; given up where three
  /// corrections, one behind the other, leave more than a tenth. `most`: cycles.
  IterationReport solve(const GridOperator& a, std::span<const double> b, std::span<double> x, double tolerance,
                        double rounding, int most);

 private:
  FloatCycles(MultigridOf<float> cycles, const Team& team);

  MultigridOf<float> cycles_;
  Team team_;
  double factor_ = 1;  // of right sides
  NumbersOf<float> right_, made_;
};

}  // namespace dpde
