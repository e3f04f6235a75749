// SPDX-License-Identifier: Apache-2.0
// Fields that solve an equation, as statements before the kernel that reads them.
#include "model/analyse/solves.h"
#include "model/build.h"
#include "stencil/build.h"
#include "stencil/space/discretise.h"

namespace dpde::stencil {

std::vector<std::string> PreparedSolve::fields_made() const {
  std::vector<std::string> fields{unknown, image, at_rest, of_walls, total, between_walls};
  if (preconditioner) fields.insert(fields.end(), {preconditioner->inputs.front(), preconditioner->results.front()});
  if (!iterations) return fields;
  IterationFields passes = *iterations;
  for (const auto& [what, field] : passes.all()) fields.push_back(*field);
  return fields;
}

IterationFields Discretiser::iteration_fields(const model::Solve& solve) {
  IterationFields fields;
  fields.count = *solve.iterations;
  for (const auto& [what, field] : fields.all()) *field = names_.fresh(solve.name + "_" + what);
  return fields;
}

NetworkCall Discretiser::preconditioner_of(const model::Solve& solve) {
  const auto& call = std::get<model::NetworkCall>((*solve.preconditioner)->kind);
  const std::vector<model::Placement> places = placements_.places_of(call, {}).arguments;
  NetworkCall made{call.network, NetworkCall::Mode::value, {names_.fresh(solve.name + "_residual")}, {}, {}, false};
  for (std::size_t i = 1; i < call.arguments.size(); ++i) {
    Place place{};
    for (std::size_t axis = 0; axis < place.size(); ++axis) place[axis] = places[i][axis] ? 1 : 0;
    made.inputs.push_back(stored_operand(call.arguments[i], place));
  }
  made.results = {names_.fresh(solve.name + "_towards")};
  return made;
}

/// The field of the unknown. Preparations of the operator do not depend on the unknown and run before the solve.
std::string Discretiser::stored_solve(const model::Expr& e) {
  for (const Operand& known : operands_) {
    if (known.value == e) return known.field;
  }
  const auto& solve = std::get<model::Solve>(e->kind);
  if (model::is_of_waves(solve, scheme_)) return stored_waves({{e, 1.0}});
  PreparedSolve made;
  made.state.name = solve.name;
  made.state.placement = placements_.of(solve.name);
  Place place{};
  for (std::size_t axis = 0; axis < place.size(); ++axis) place[axis] = made.state.placement[axis] ? 1 : 0;
  made.right = stored_operand(solve.right, place);
  made.state.boundary = solve.boundary;
  made.by = scheme_.solve;
  for (const std::string& guess : solve.guesses) {
    const auto stands_for = reading_.fields.find(guess);
    made.guesses.push_back(stands_for == reading_.fields.end() ? guess : stands_for->second);
  }
  for (const model::Expr& start : solve.starts) made.starts.push_back(stored_operand(start, place));
  if (solve.iterations) made.iterations = iteration_fields(solve);
  if (solve.preconditioner) made.preconditioner = preconditioner_of(solve);
  // the unknown may be a state: it is then another field
  const char* const suffix = solve.iterations ? "_direction" : names_.is_used(solve.name) ? "_solved" : "";
  made.unknown = names_.fresh(solve.name + suffix);
  made.image = names_.fresh(solve.name + "_image");
  Environment reading = reading_;
  reading.fields[solve.name] = made.unknown;
  Discretiser body(scheme_, names_, rank_, std::move(reading), placements_);
  body.parts_ = parts_;
  body.preparations_ = preparations_;
  body.operands_ = operands_;
  const Expr image = body.at(solve.operation, place).value();
  parts_ = body.parts_;
  preparations_ = body.preparations_;
  operands_ = body.operands_;
  names_ = body.names_;
  for (auto* field : {&made.at_rest, &made.of_walls, &made.total}) *field = names_.fresh(solve.name + "_walls");
  made.between_walls = names_.fresh(solve.name + "_between_walls");
  made.kernel = Kernel{"", rank_, body.lets_, {{made.image, false, image, e->origin}}, {}, {}};
  preparations_.emplace_back(std::move(made));
  operands_.push_back({e, {}, std::get<PreparedSolve>(preparations_.back()).result()});
  return operands_.back().field;
}

}  // namespace dpde::stencil
