// SPDX-License-Identifier: Apache-2.0
// Details of a NoSolution for messages; code that only shortens the step needs just the exception type.
#pragma once

#include <functional>
#include <limits>
#include <string>

#include "dpde/runtime/error.h"

namespace dpde {

/// What failed, and where.
struct UnsolvedFacts {
  enum class What {
    solve,     // a linear solve of the model, a constraint, an implicit stage
    newton,    // a nonlinear one
    substeps,  // no substep is short enough
    steady,    // no steady state, or no derivative of it
    jump       // a jump: there is no gradient
  };
  What what = What::solve;
  std::string text;         // a sentence without full stop and step: "solve for psi: ..."
  std::string reason = {};  // of a solve: the same without the unknown's name, which differs in tangents
  std::string method = {};  // of a solve: its name in a scheme
  double residual = std::numeric_limits<double>::quiet_NaN();  // relative residual |A*x - b|/|b|
  /// What to write instead, found only on demand; for a solve by trying other methods on its system.
  std::function<std::string()> advice = {};
  int step = 0, steps = 0;  // step `step` of `steps`, from 1; 0: outside of steps
  double t = std::numeric_limits<double>::quiet_NaN();
};

/// Thrown by every kind of solve without a solution, linear or not.
class Unsolved : public NoSolution {
 public:
  explicit Unsolved(UnsolvedFacts facts) : NoSolution(facts.text), facts_(std::move(facts)) {}
  const UnsolvedFacts& facts() const { return facts_; }
  /// "" if nothing is known.
  std::string hint() const { return facts_.advice ? facts_.advice() : std::string(); }
  /// Adds the location: step `step` of `steps`, which begins at t; step 0: time t, outside of steps. The first
  /// (innermost) call wins.
  void set_place(int step, int steps, double t);

 private:
  UnsolvedFacts facts_;
};

}  // namespace dpde
