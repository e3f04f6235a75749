// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/iterations_from_model.h"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "model/build.h"
#include "model/uses.h"
#include "stencil/analyse/operator_traits.h"
#include "stencil/walk.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

/// Conjugate gradients need a symmetric operator, which can be tested only on its differences. They are taken from the
/// block of the same solve with a tolerance.
void check_one(const Lowering& lowering, const model::Expr& e, DiagnosticSink& sink) {
  model::Solve plain = std::get<model::Solve>(e->kind);
  plain.iterations.reset();
  plain.starts.clear();
  plain.preconditioner.reset();
  Discretiser at_point = lowering.discretiser();
  Kernel kernel = lowering.kernel("solved");
  kernel.stores.push_back({"solved", false, at_point(model::solve(plain, e->origin)), {}});
  Module module;
  const Program& program = lowering.add_program(module, "solved", {Lowering::stage(std::move(kernel), at_point)});
  const auto is_it = [&](const Solve& made) { return made.written.field == plain.name; };
  const Solve* solve = find_kind<Solve>(program.body, is_it);
  require(solve != nullptr, "a solve of what is solved");
  const OperatorTraits traits = traits_of(module, program, *solve);
  Params values;
  for (const model::Parameter& param : lowering.problem().params) values[param.name] = param.value;
  if (traits_of(module, program, *solve, values).takes_constants_to_zero != traits.takes_constants_to_zero) {
    sink.report("solve-does-not-fit", e->origin.range,
                {plain.name,
                 "the values of parameters alone make its operator one that takes constants to 0, and "
                 "iterations would leave the mean as it is"},
                "write the operator without the term that is 0, whose constants are then known; without after any "
                "operator is solved");
    return;
  }
  if (traits.is_symmetric) return;
  sink.report("solve-does-not-fit", e->origin.range,
              {plain.name, "conjugate gradients need a symmetric operator, which this is not with its boundary"},
              "take sums of lap, div(k*grad(...)) and products, central differences, and values or slopes at walls; "
              "without after any operator is solved");
}

}  // namespace

void check_iterations(const Lowering& lowering, DiagnosticSink& sink) {
  std::vector<model::Expr> known;
  const std::function<bool(const model::Expr&)> look = [&](const model::Expr& e) {
    const model::Solve* solve = as<model::Solve>(e);
    if (solve == nullptr || !solve->iterations || std::ranges::find(known, e) != known.end()) return false;
    known.push_back(e);
    return false;
  };
  model::for_each_formula(lowering.problem(), [&](const model::Use& use) {
    if (model::is_of_states(use.kind)) any_part(use.formula, look);
  });
  for (const model::Expr& e : known) check_one(lowering, e, sink);
}

}  // namespace dpde::stencil
