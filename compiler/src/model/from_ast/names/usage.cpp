// SPDX-License-Identifier: Apache-2.0
// Removes or reports unused items. A hand-written program uses all inputs of its kernels.
#include <algorithm>

#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/uses.h"
#include "support/assert.h"

namespace dpde::model {

namespace {

bool may_read_coefficients(UseKind kind) {
  switch (time_of(kind)) {
    case UseTime::step:
    case UseTime::result:
    case UseTime::field:
    case UseTime::boundary: return true;
    case UseTime::geometry: return false;  // of coordinates
    case UseTime::never: return false;     // its uses are counted where it is called
  }
  unreachable("time of a use");
}

/// Whether a formula reads the coefficient or the task optimises it.
bool is_needed(const Problem& problem, const std::string& coefficient) {
  const bool found = problem.task && std::ranges::any_of(problem.task->unknowns, [&](const Unknown& unknown) {
                       return unknown.kind == Unknown::Kind::coefficient && unknown.name == coefficient;
                     });
  return found || any_formula(problem, [&](const Use& use) {
           return may_read_coefficients(use.kind) && reads(use.formula, coefficient);
         });
}

}  // namespace

void drop_unused(Elaboration& elaboration) {
  Problem& problem = elaboration.problem;
  for (Parameter& parameter : problem.params) parameter.is_fixed = elaboration.params.fixed.contains(parameter.name);
  if (elaboration.blocks.program) return;
  std::vector<Coefficient> kept;
  for (const Coefficient& coefficient : problem.coefficients) {
    if (is_needed(problem, coefficient.name)) {
      kept.push_back(coefficient);
    } else {
      problem.remarks.dropped.push_back("coefficient " + coefficient.name + ": nothing reads it");
    }
  }
  problem.coefficients = std::move(kept);
  for (const Parameter& parameter : problem.params) {
    if (elaboration.params.used.contains(parameter.name)) continue;
    problem.remarks.dropped.push_back("parameter " + parameter.name + ": nothing uses it");
    if (!elaboration.selection.beside.empty()) continue;  // the task's own scene may use it
    elaboration.sink.report("unused-parameter", elaboration.names.scope.find(parameter.name)->declared,
                            {parameter.name});
  }
}

}  // namespace dpde::model
