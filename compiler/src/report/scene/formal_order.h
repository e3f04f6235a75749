// SPDX-License-Identifier: Apache-2.0
// The formal order of a scene's step, walls included, and of the operators of its file.
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
  int space = 0, time = 0;   // 0 in space: nothing is differentiated
  bool is_spectral = false;  // in space: all derivatives are Fourier series
  std::string walls = "";    // what makes it lower there than differences of values beyond them do
};

/// Of an operator of the file, as stated and as measured.
struct OperatorOrder {
  std::string name;
  int stated = 0;
  std::optional<int> measured = {};  // none where there is no such number
  std::string words = {};            // behind the stated one: what was measured, or why nothing was
  bool operator==(const OperatorOrder&) const = default;
};

struct FormalOrder {
  bool is_known = false;  // not of hand-written programs
  Order inside;           // away from walls
  Order smooth;           // with walls, where no coefficient jumps
  Order whole;
  std::vector<std::string> jumps;  // what lowers it
  bool is_by_tolerance = false;    // steps in time are no equal ones
  std::vector<OperatorOrder> operators;
};
/// `jumps`: what lowers it, where that is known.
FormalOrder formal_order(const model::Problem& problem, const std::vector<driver::Jump>& jumps = {});

/// The keys order and, of what is known, operators.
Json json_of(const FormalOrder& order);
std::string text_of(const FormalOrder& order);

/// That the order is 1 there, and what to write.
void warn_of_jumps(const std::vector<driver::Jump>& jumps, DiagnosticSink& sink);

}  // namespace dpde::report
