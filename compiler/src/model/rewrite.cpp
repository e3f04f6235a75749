// SPDX-License-Identifier: Apache-2.0
#include "model/rewrite.h"

#include "model/uses.h"
#include "support/assert.h"

namespace dpde::model {

namespace {

bool is_in_coordinates(UseKind kind) {
  switch (time_of(kind)) {
    case UseTime::step:
    case UseTime::result:
    case UseTime::field:
    case UseTime::never: return true;
    case UseTime::boundary:
    case UseTime::geometry: return false;
  }
  unreachable("time of a use");
}

}  // namespace

void rewrite_in_coordinates(Problem& problem, const FormulaRule& rule) {
  rewrite_formulas(
      problem, [&](const Use& use) { return is_in_coordinates(use.kind) ? rule(use.formula, use.home) : use.formula; });
}

}  // namespace dpde::model
