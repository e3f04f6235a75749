// SPDX-License-Identifier: Apache-2.0
// What a NoSolution of a run says of itself: whoever takes a shorter step needs to know no more than that it is one.
#pragma once

#include <functional>
#include <limits>
#include <string>

#include "dpde/runtime/error.h"

namespace dpde {

/// What has no solution, and where.
struct UnsolvedFacts {
  enum class What {
    solve,     // a linear solve of the text, a constraint, an implicit stage
    newton,    // one that is not linear
    substeps,  // no substep is short enough
    steady,    // no steady state, or no derivative of it
    jump       // something jumps: there is no gradient
  };
  What what = What::solve;
  std::string text;         // a sentence without its end and without the step: "solve for psi: ..."
  std::string reason = {};  // of a solve: the same without the name of the unknown, which tangents have of their own
  std::string method = {};  // of a solve, as a scheme names it
  double residual = std::numeric_limits<double>::quiet_NaN();  // what is left of the right side, as a part of it
  /// What to write instead, found out only when it is asked for: of a solve by trying other methods on its system.
  std::function<std::string()> advice = {};
  int step = 0, steps = 0;  // step `step` of `steps`, from 1; 0: outside of steps
  double t = std::numeric_limits<double>::quiet_NaN();
};

/// All that finds no solution throws it, linear or not, and whatever its method.
class Unsolved : public NoSolution {
 public:
  explicit Unsolved(UnsolvedFacts facts) : NoSolution(facts.text), facts_(std::move(facts)) {}
  const UnsolvedFacts& facts() const { return facts_; }
  /// "" where nothing is known.
  std::string hint() const { return facts_.advice ? facts_.advice() : std::string(); }
  /// It happened in step `step` of `steps`, which begins at t; 0: at t, outside of steps. The innermost place counts.
  void set_place(int step, int steps, double t);

 private:
  UnsolvedFacts facts_;
};

}  // namespace dpde
