// SPDX-License-Identifier: Apache-2.0
// The formal order of a scene's step, with walls, and of the operators in its file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "driver/report/jumps.h"
#include "model/model.h"
#include "source/diagnostic.h"
#include "support/json.h"

namespace dpde::report {

struct Order {
  int space = 0, time = 0;   // space 0: no derivatives
  bool is_spectral = false;  // in space: all derivatives by Fourier series
  std::string walls = "";    // reason if walls lower the order more than ghost values do
};

/// Order of an operator in the file, as stated and as measured.
struct OperatorOrder {
  std::string name;
  int stated = 0;
  std::optional<int> measured = {};  // nullopt if there is no such number
  std::string words = {};            // text after the stated order: the measured one, or why there is none
  bool operator==(const OperatorOrder&) const = default;
};

struct FormalOrder {
  bool is_known = false;  // false for hand-written programs
  Order inside;           // away from walls
  Order smooth;           // with walls, without jumps of coefficients
  Order whole;
  std::vector<std::string> jumps;  // jumps that lower it
  bool is_by_tolerance = false;    // time steps are adaptive
  std::vector<OperatorOrder> operators;
};
/// `jumps`: jumps that lower the order, if known.
FormalOrder formal_order(const model::Problem& problem, const std::vector<driver::Jump>& jumps = {});

/// The keys order and, as far as known, operators.
Json json_of(const FormalOrder& order);
std::string text_of(const FormalOrder& order);
/// Of operators with a stated order.
std::string text_of_operators(const FormalOrder& order);

/// Warns that the order is 1 at jumps, with advice.
void warn_of_jumps(const std::vector<driver::Jump>& jumps, DiagnosticSink& sink);

}  // namespace dpde::report
