// SPDX-License-Identifier: Apache-2.0
// What the solves of a program have met, for whoever tells the user.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace dpde {

/// Of right sides of a singular operator.
struct OutOfReach {
  double part = 0;              // the largest of b that no x reaches, over |b|
  double of_least_squares = 0;  // that of solutions whose derivative is not known, more than rounding
  /// Coefficients and parameters of the operator, where with other values of them x may reach it: by those there is no
  /// derivative.
  std::vector<std::string> made_of;
};

struct SolveNote {
  std::string unknown;                 // the field that is sought
  std::string method, reason;          // of the last one; "" before there was one
  int64_t solves = 0, iterations = 0;  // all of them
  int64_t unaided = 0;                 // iterations for which a network's direction was of no use
  int most_iterations = 0;             // of one
  double seconds = 0, setup = 0;       // of a processor: in all solves, and in making solvers for changed operators
  double residual = 0;                 // the largest |A*x - b|/|b|
  double tolerance = 0;                // to which the solver of that one had to come
  OutOfReach out_of_reach;
  int64_t missed = 0;  // solves that did not come to the tolerance and were to be a warning
  /// Of the one of those that left most: what to write instead, found out when it is asked for by trying methods on its
  /// system; "" where none is tried.
  std::function<std::string()> advice = {};
};

}  // namespace dpde
