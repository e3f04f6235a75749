// SPDX-License-Identifier: Apache-2.0
// Compares a scene with plain schemes: their cost at the same error, and their error at the same cost.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace dpde::analysis {

/// Both must be positive; cost in seconds per unit of simulated time.
struct CostAndError {
  std::string scene;
  double cost = 0, error = 0;
};

struct Equal {
  /// beyond_all, within_all: outside the range of the schemes, see below.
  enum class Kind { found, beyond_all, within_all } kind = Kind::found;
  double value = 0;
  std::string from, to;  // the scenes between which it was interpolated; twice the same name for a single one
};

/// The Pareto front: schemes for which no other has at most the same cost and error. Cheapest first; omits values that
/// are not finite and positive.
std::vector<CostAndError> best_of(std::vector<CostAndError> schemes);

/// Log-log interpolation between neighbours of best_of(schemes). beyond_all: no scheme reaches the error. within_all:
/// even the cheapest one does; `value` is its cost.
Equal cost_of_equal_error(const std::vector<CostAndError>& schemes, double error);
/// beyond_all: no scheme is as cheap. within_all: even the most expensive one is cheaper; `value` is its error.
Equal error_of_equal_cost(const std::vector<CostAndError>& schemes, double cost);

/// Number of runs after which an investment pays off.
struct BreakEven {
  enum class Kind { after, never, unknown } kind = Kind::unknown;
  double runs = 0;  // not necessarily an integer
};
/// Compares a network of `cost` per unit of time, for which `spent` was spent, with plain schemes of the same error, in
/// runs of `length` units of time. never: the plain scheme is as cheap or cheaper. unknown: none reaches the error.
BreakEven break_even(const Equal& equal_error, double cost, double length, double spent);

}  // namespace dpde::analysis
