// SPDX-License-Identifier: Apache-2.0
// Statistics of the solves of a program, for messages to the user.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace dpde {

/// Right sides of a singular operator that are not in its range.
struct OutOfReach {
  double part = 0;              // the largest part of b outside of the range of A, over |b|
  double of_least_squares = 0;  // the same for least-squares solutions of unknown derivative, if above rounding
  /// Coefficients and parameters of the operator whose change may put b into the range: the solution has no derivative
  /// with respect to these.
  std::vector<std::string> made_of;
};

/// Statistics of one solve of the model.
struct SolveNote {
  std::string unknown;                 // the field solved for
  std::string method, reason;          // of the last solve; "" before the first
  int64_t solves = 0, iterations = 0;  // totals
  int64_t unaided = 0;                 // iterations in which a network's direction did not help
  int most_iterations = 0;             // of one solve
  double seconds = 0, setup = 0;       // processor time: of all solves, and of setting up solvers for changed operators
  double residual = 0;                 // the largest |A*x - b|/|b|
  double tolerance = 0;                // tolerance of the solve with that residual
  OutOfReach out_of_reach;
  int64_t missed = 0;  // solves above the tolerance that were set to warn
  /// For the one of them with the largest residual: what to write instead, found on demand by trying methods on its
  /// system; "" if none is tried.
  std::function<std::string()> advice = {};
};

}  // namespace dpde
