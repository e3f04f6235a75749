// SPDX-License-Identifier: Apache-2.0
// Lets in file order, then the equations: one per field.
#include <fmt/format.h>

#include "model/analyse/solves.h"
#include "model/boundary/metric.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/coordinates.h"

namespace dpde::model {

namespace {

void bind_let(Elaboration& elaboration, const ast::LetItem& item) {
  TypedExpr value = formulas::definition({elaboration, FormulaContext::equation, "let " + item.name.name}, item.value);
  value.unit = elaboration.measures.define(item.name.name, item.value);
  if (!declare(elaboration, item.name, Role::let)) return;
  if (value.type != TypedExpr::Type::none) elaboration.names.lets.emplace(item.name.name, std::move(value));
}

/// Whether a fixed number of differentiated iterations is possible. Symmetry of the operator is checked where its
/// differences are known: stencil/lower/from_model.cpp.
bool fits_iterations(Elaboration& elaboration, const Solve& solved, SourceRange range) {
  const auto refuse = [&](const char* why, const char* hint) {
    elaboration.sink.report("solve-does-not-fit", range, {solved.name, why}, hint);
    return false;
  };
  if (*solved.iterations < 0) return refuse("its iterations are a number from 0 on", "as in after 5 iterations");
  if (solved.starts.size() > 1)
    return refuse("iterations begin with one guess, as it is", "write their sum: from a + b after 5 iterations");
  if (*solved.iterations == 0 && solved.starts.empty())
    return refuse("0 iterations make nothing where there is no guess", "as in from guess(omega) after 0 iterations");
  if (is_of_waves(solved, elaboration.problem.scheme))
    return refuse("it is solved wave by wave, which has no iterations", "leave out after, or take lap = central(2)");
  return true;
}

/// In its own equation the name stands for the unknown, afterwards for the solution.
void bind_solved(Elaboration& elaboration, const ast::SolvedItem& item, SourceRange range) {
  const std::string& name = item.unknown.name;
  elaboration.solves.solved.insert(name);
  if (!declare(elaboration, item.unknown, Role::let)) return;
  elaboration.names.lets[name] = {TypedExpr::Type::number, {field(name, {item.unknown.range})}};
  FormulaScope scope{elaboration, FormulaContext::equation, name};
  const auto left = formulas::number(scope, item.left), right = formulas::number(scope, item.right);
  const auto starts = starts_of(elaboration, item.starts, name);
  elaboration.names.lets.erase(name);
  if (!left || !right || !starts) return;
  const Expr difference = binary(BinaryOp::subtract, *left, *right);
  Origin nonlinear;
  const std::optional<LinearPart> parts = linear_part(difference, name, nonlinear);
  if (!parts) {
    elaboration.sink.report(
        "not-linear-in", nonlinear.range.is_known() ? nonlinear.range : range, {name},
        fmt::format("write sums of products of {0} and its derivatives with what does not hold {0}", name));
    return;
  }
  if (is_literal(parts->part, 0)) {
    elaboration.sink.report("solve-does-not-fit", range, {name, "the equation does not hold it"},
                            "as in lap(phi) = omega");
    return;
  }
  const bool is_advected = holds_any<Advect>(parts->part);
  const Advection advect = elaboration.problem.scheme.transport.advect;
  if (is_advected && advect != Advection::central && advect != Advection::upwind) {
    elaboration.sink.report("solve-does-not-fit", range,
                            {name, "the scheme's advection is not linear in what is carried"},
                            "take advect = central(2), upwind(3), ...");
    return;
  }
  if (reads_across_pole(elaboration.problem, parts->part)) {
    elaboration.sink.report("solve-does-not-fit", range, {name, "its equation reads across a pole"},
                            "with dx = central(2) lap(u) and div(k*grad(u)) end at poles");
    return;
  }
  const Coordinates coordinates(elaboration.problem, {range});  // equal weights of a flux in both its cells
  Solve solved{name, coordinates.times_volume(parts->part), coordinates.times_volume(negate(parts->rest)),
               boundary_of_solved(elaboration, name)};
  const Scheme& scheme = elaboration.problem.scheme;
  if (holds_waves(solved, scheme) && (!is_of_waves(solved, scheme) || holds_odd_orders(solved))) {
    elaboration.sink.report(
        "solve-does-not-fit", range,
        {name, "by Fourier series its derivatives are of even orders, with coefficients that are the same everywhere"},
        "take lap = spectral and no dx of it, or dx, lap and advect = central(2), ... in the scheme");
    return;
  }
  solved.starts = *starts;
  solved.iterations = item.iterations;
  if (!item.iterations) add_guesses(elaboration, solved, {range});
  if (item.iterations && !fits_iterations(elaboration, solved, range)) return;
  if (!add_preconditioner(elaboration, item.preconditioner, solved)) return;
  elaboration.names.lets[name] = {TypedExpr::Type::number, {solve(std::move(solved), {range})}};
}

/// A field determined by a constraint has no time derivative: it keeps its value until a stage recomputes it.
void bind_multipliers(Elaboration& elaboration, std::map<std::string, SourceRange>& seen) {
  for (const auto& [item, range] : items_of<ast::ConstraintItem>(elaboration.blocks.model->items)) {
    const std::vector<State*> states = find_states(elaboration, item.multiplier, "a constraint");
    if (states.empty() || !is_first(elaboration, "the constraint", item.multiplier, states, seen)) continue;
    elaboration.solves.multipliers.insert(states.front()->name);
    states.front()->rhs = 0.0;
    states.front()->origin = {range};
  }
}

}  // namespace

void bind_equations(Elaboration& elaboration) {
  for (const ast::Item& item : elaboration.blocks.model->items) {
    if (const auto* let = get_if<ast::LetItem>(&item.kind)) bind_let(elaboration, *let);
    if (const auto* solved = get_if<ast::SolvedItem>(&item.kind)) bind_solved(elaboration, *solved, item.range);
  }
  std::map<std::string, SourceRange> seen;
  bind_multipliers(elaboration, seen);
  for (const auto& [item, range] : items_of<ast::EquationItem>(elaboration.blocks.model->items)) {
    const std::string rated = rated_field(item.field.name);
    const ast::Identifier name{rated.empty() ? item.field.name : rated, item.field.range};
    const std::vector<State*> moved = find_states(elaboration, name, "an equation");
    const std::vector<State*> states =
        rated.empty() || moved.empty() ? moved : find_states(elaboration, item.field, "an equation");
    if (states.empty() || !is_first(elaboration, "the equation", name, moved, seen)) continue;
    const std::string subject = fmt::format("dt({})", item.field.name);
    const auto rhs = formulas::components({elaboration, FormulaContext::equation, subject}, item.rhs, item.field.name);
    for (std::size_t i = 0; i < states.size(); ++i) {
      if (!rated.empty()) moved[i]->rhs = field(states[i]->name, {item.field.range});
      moved[i]->origin = states[i]->origin = {range};
      seen.emplace(states[i]->name, item.field.range);
      if (rhs) states[i]->rhs = (*rhs)[i];
    }
  }
  for (const std::string& name : states_not_in(elaboration, seen)) {
    const char* hint = elaboration.solves.solved.contains(name)
                           ? "leave {0} out here: the solve for {0} declares it"
                           : "write dt({0}) = ..., or coefficient {0} for what does not change";
    elaboration.sink.report("missing-equation", elaboration.names.scope.find(name)->declared, {name},
                            fmt::format(fmt::runtime(hint), name));
  }
}

}  // namespace dpde::model
