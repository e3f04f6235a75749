// SPDX-License-Identifier: Apache-2.0
#include "stencil/semi_lagrangian.h"

#include <optional>
#include <utility>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/time_schemes.h"

namespace dpde::stencil {

namespace {

/// The terms of a sum with their signs.
struct Term {
  model::Expr value;
  bool negative;
};

void collect_terms(const model::Expr& e, bool negative, std::vector<Term>& terms) {
  if (const auto* neg = std::get_if<model::Neg>(&e->kind)) return collect_terms(neg->operand, !negative, terms);
  const auto* b = std::get_if<model::Binary>(&e->kind);
  if (b && (b->op == BinaryOp::add || b->op == BinaryOp::subtract)) {
    collect_terms(b->left, negative, terms);
    collect_terms(b->right, negative != (b->op == BinaryOp::subtract), terms);
    return;
  }
  terms.push_back({e, negative});
}

const model::Advect* as_advect(const model::Expr& e) { return std::get_if<model::Advect>(&e->kind); }

bool holds_advect(const model::Expr& e) {
  return model::any_part(e, [](const model::Expr& x) { return as_advect(x) != nullptr; });
}

/// Whether a term is -advect(v, state) with a velocity that transports nothing itself.
bool is_transport(const Term& term, const std::string& state) {
  const model::Advect* advect = as_advect(term.value);
  if (!advect || !term.negative) return false;
  const auto* field = std::get_if<model::Field>(&advect->operand->kind);
  if (!field || field->name != state) return false;
  for (const model::Expr& component : advect->velocity) {
    if (holds_advect(component)) return false;
  }
  return true;
}

/// The equation without its transport, nothing when that was all; the other terms keep their shape.
std::optional<model::Expr> without_transport(const model::Expr& e) {
  if (as_advect(e)) return std::nullopt;
  if (const auto* neg = std::get_if<model::Neg>(&e->kind)) {
    const auto rest = without_transport(neg->operand);
    return rest ? std::optional(model::Expr(model::Node{model::Neg{*rest}, e->origin})) : std::nullopt;
  }
  const auto* b = std::get_if<model::Binary>(&e->kind);
  if (!b || (b->op != BinaryOp::add && b->op != BinaryOp::subtract)) return e;
  const auto left = without_transport(b->left);
  const auto right = without_transport(b->right);
  if (left && right) return model::Expr(model::Node{model::Binary{b->op, *left, *right}, e->origin});
  if (!right) return left;
  if (b->op == BinaryOp::add) return right;
  return model::Expr(model::Node{model::Neg{*right}, e->origin});
}

const model::Advect* find_transport(const model::State& state) {
  std::vector<Term> terms;
  collect_terms(*state.rhs, false, terms);
  for (const Term& term : terms) {
    if (const model::Advect* advect = as_advect(term.value)) return advect;  // lives as long as the equation
  }
  return nullptr;
}

void check_state(const model::State& state, DiagnosticSink& sink) {
  std::vector<Term> terms;
  collect_terms(*state.rhs, false, terms);
  int transports = 0;
  for (const Term& term : terms) {
    const bool fine = is_transport(term, state.name);
    transports += fine;
    if ((fine && transports == 1) || (!fine && !holds_advect(term.value))) continue;
    const SourceRange range = term.value->origin.range.is_known() ? term.value->origin.range : state.origin.range;
    sink.report("advection-form", range, {state.name, state.name},
                "write dt(" + state.name + ") = -advect(v, " + state.name +
                    ") + other terms, or take advect = central(2) or upwind(1) in the scheme");
    return;
  }
}

/// `value` with its interpolations along `axis` and those behind it made cubic.
Expr cubic(const Interp& value, const std::vector<model::Axis>& axes, std::size_t axis) {
  if (axis == axes.size()) return interp(value);
  if (axes[axis].topology == Topology::bounded) return cubic(value, axes, axis + 1);
  const auto slope = [&](int cells) {
    Interp moved = value;
    moved.offset[axis] += cells;
    moved.slope[axis] = true;
    return cubic(moved, axes, axis + 1);
  };
  const Expr f = call(Fn::fraction, {value.displacement[axis]});
  const Expr middle = slope(0), left = middle - slope(-1), right = slope(1) - middle;
  return cubic(value, axes, axis + 1) - f * (1.0 - f) / 6.0 * ((2.0 - f) * left + (1.0 + f) * right);
}

Expr arrival_value(const model::Advect& advect, const std::string& field, const Lowering& lowering, Discretiser& at_point) {
  const bool is_cubic = lowering.problem().scheme.advect_order == 3;
  Interp value;
  value.field = field;
  for (int axis = 0; axis < static_cast<int>(advect.velocity.size()); ++axis) {
    const Expr displacement = -(param("dt") * at_point(advect.velocity[axis]) / spacing(axis));
    value.displacement.push_back(is_cubic ? at_point.shared("departure_" + axis_letter(axis), displacement) : displacement);
  }
  return is_cubic ? cubic(value, lowering.problem().axes, 0) : interp(value);
}

}  // namespace

void check_semi_lagrangian(const model::Problem& problem, DiagnosticSink& sink) {
  for (const model::State& state : problem.states) {
    if (state.rhs) check_state(state, sink);
  }
}

std::vector<Stage> semi_lagrangian_stages(Lowering& lowering, const std::vector<std::string>& into) {
  const std::vector<model::State>& states = lowering.problem().states;
  std::vector<Advance> advances;
  Reading reading;
  for (const model::State& state : states) {
    const std::optional<model::Expr> terms = without_transport(*state.rhs);
    if (!terms || model::is_constant(*terms, 0)) continue;
    reading.fields[state.name] = lowering.field_beside(state.name, "mid");
    advances.push_back({state.name, *terms, reading.fields[state.name], state.origin});
  }
  const std::string& scene = lowering.problem().scene;
  std::vector<Stage> stages;
  if (!advances.empty()) stages = time_stages(lowering, advances, scene + "_terms", scene);

  reading.time = param("t") + param("dt");
  Discretiser at_point = lowering.discretiser(reading);
  Kernel kernel = lowering.kernel(scene + "_advect");
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto found = reading.fields.find(states[i].name);
    const std::string field = found == reading.fields.end() ? states[i].name : found->second;
    const model::Advect* transport = find_transport(states[i]);
    const Expr value = transport ? arrival_value(*transport, field, lowering, at_point) : access(field);
    kernel.stores.push_back({into[i], false, value, states[i].origin});
  }
  stages.push_back(Lowering::stage(std::move(kernel), at_point, reading.time));
  return stages;
}

}  // namespace dpde::stencil
