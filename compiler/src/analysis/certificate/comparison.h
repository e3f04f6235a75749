// SPDX-License-Identifier: Apache-2.0
// What a scene's error is worth in plain schemes: what they cost for the same error, and lose for the same cost.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace dpde::analysis {

/// Both positive; cost in seconds a unit of simulated time.
struct CostAndError {
  std::string scene;
  double cost = 0, error = 0;
};

struct Equal {
  /// Where the schemes do not reach that far there is no number.
  enum class Kind { found, beyond_all, within_all } kind = Kind::found;
  double value = 0;
  std::string from, to;  // the scenes between which it was interpolated, of a single one twice its name
};

/// Those of which no other is at most as dear and has at most the same error; cheapest first. What is not finite and
/// positive is left out.
std::vector<CostAndError> best_of(std::vector<CostAndError> schemes);

/// By interpolation of the logarithms between neighbours of best_of(schemes). beyond_all: none reaches the error.
/// within_all: even the cheapest one does, `value` its cost.
Equal cost_of_equal_error(const std::vector<CostAndError>& schemes, double error);
/// beyond_all: none is as cheap. within_all: even the dearest one is cheaper, `value` its error.
Equal error_of_equal_cost(const std::vector<CostAndError>& schemes, double cost);

/// After how many runs what was spent beforehand is earned.
struct BreakEven {
  enum class Kind { after, never, unknown } kind = Kind::unknown;
  double runs = 0;  // not a whole number
};
/// Of a network that costs `cost` a unit of time, and had `spent` spent on it, against plain schemes of the same error;
/// runs of so much time. never: the plain scheme is at most as dear. unknown: none reaches the error.
BreakEven break_even(const Equal& equal_error, double cost, double length, double spent);

}  // namespace dpde::analysis
