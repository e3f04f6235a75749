// SPDX-License-Identifier: Apache-2.0
// Corrections after each stage of a step.
//
// 0 = div(u) gives p: the field p in the right-hand side of u keeps div(u) at 0. A stage uses the right-hand sides
// without p and then computes u + G(phi), where G(p) is the removed term and C(u + G(phi)) = 0 for the constraint C:
// phi is p times the time over which the stage integrated (Chorin 1968; of the order of the Runge-Kutta method if every
// stage projects, Sanderse and Koren 2012).
//
// 0 = div(u) gives p each step: stages use the right-hand sides with p', the p of the step before, and only the last
// one computes u + G(phi), where phi is (p - p') times the step. p - p' is of order dt, so the error of a stage U_i is
// dt*sum_j a_ij*G(p - p') = O(dt^2), and that of a step O(dt^3): order 2, or the order of the method if lower (Karam,
// Sutherland and Saad 2021; De Michele, Capuano and Coppola 2020). Without p' the error of a stage would be O(dt), and
// the order 1.
//
// u = v inside solid: a point on a face is inside if one of its cells is. The result of a stage is replaced there by v,
// and the constraint does not change it: inside, G is 0 and u is v.
#include <fmt/format.h>

#include <algorithm>

#include "model/analyse/placement.h"
#include "model/analyse/solves.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

/// Whether a point of the state is inside. On faces the mean of both cells is 0, 1/2 or 1. Means of higher order are
/// 0.35 or more if one of the two cells is inside, and 0.05 or less if only cells further away are.
Expr inside_at(const Elaboration& elaboration, const State& state, const std::string& mask, Origin origin) {
  const auto moving = elaboration.masks.moving.find(mask);
  const Expr cell = moving == elaboration.masks.moving.end() ? field(mask, origin) : moving->second;
  const Expr here = state.placement == Placement{} ? cell : interpolate(cell, origin);
  return binary(BinaryOp::greater, here, 0.25, origin);
}

/// `free`, replaced inside the mask of the state.
Expr with_held(const State& state, const Expr& free) {
  return state.held ? select(state.held->inside, state.held->value, free) : free;
}
/// The correction of a state; 0 inside its mask.
Expr without_held(const State& state, const Expr& push) {
  return state.held ? select(state.held->inside, 0.0, push) : push;
}

/// False, with a diagnostic, for schemes that allow no action after stages; `what` is for the message.
bool has_stages(Elaboration& elaboration, SourceRange range, const char* what) {
  const Scheme& scheme = elaboration.problem.scheme;
  const bool by_time = is_exponential(scheme.time) || is_verlet(scheme.time) || is_leapfrog(scheme.time);
  if (by_time)
    elaboration.sink.report("schemes-do-not-fit", range, {print(scheme.time), what}, "take time = rk4, ssp_rk3 or ab2");
  const auto subcycles = items_of<ast::SubcycleItem>(elaboration.blocks.scene->items);
  if (!subcycles.empty())
    elaboration.sink.report("not-allowed-here", subcycles.front().range,
                            {"subcycle", fmt::format("a scene with {}", what)}, "make all steps shorter");
  return !by_time && subcycles.empty();
}

class Binder {
 public:
  Binder(Elaboration& elaboration, const ast::ConstraintItem& item, SourceRange range)
      : elaboration_(elaboration), item_(item), range_(range), name_(item.multiplier.name) {}

  void bind() {
    const auto value = formulas::number({elaboration_, FormulaContext::equation, name_}, item_.value);
    const auto* zero = std::get_if<ast::Number>(&item_.zero->kind);
    if (!zero || zero->value != 0)
      return refuse(item_.zero.range(), "the left side of a constraint is 0", "write 0 = div(u) gives " + name_);
    const auto multiplier = std::ranges::find(elaboration_.problem.states, name_, &State::name);
    if (multiplier == elaboration_.problem.states.end())
      return refuse(item_.multiplier.range, "it is no number", "write field " + name_);
    const auto starts = starts_of(elaboration_, item_.starts, name_);
    if (!value || !starts || !fits(*multiplier) || !split_rates()) return;
    if (reads(*value, name_))
      return refuse(item_.value.range(), "the constraint itself holds it", "write it with the fields that it binds");
    add(*value, *multiplier, *starts);
  }

 private:
  struct Changed {
    State* state;
    Expr push;  // part of its right-hand side with the multiplier
  };

  void refuse(SourceRange at, std::string why, std::string hint) {
    elaboration_.sink.report("constraint-does-not-fit", at, {name_, std::move(why)}, std::move(hint));
  }
  void refuse_nonlinear(const Origin& nonlinear, SourceRange otherwise, const std::string& in, std::string hint) {
    elaboration_.sink.report("not-linear-in", nonlinear.range.is_known() ? nonlinear.range : otherwise, {in},
                             std::move(hint));
  }

  bool fits(const State& multiplier) {
    const Scheme& scheme = elaboration_.problem.scheme;
    if (multiplier.placement != Placement{}) {
      refuse(item_.multiplier.range, "it does not lie at the cell centres", "write field " + name_);
    } else if (scheme.derivative_order > 2 && has_sides()) {
      refuse(range_,
             fmt::format("next to walls and masks dx = central({}) does not satisfy it", scheme.derivative_order),
             "take dx = central(2)");
    } else if (is_each_stage_asked_for() && ends_with_projection(scheme)) {
      const char* what = scheme.is_split() ? "split steps" : "semi-Lagrangian advection";
      refuse(place_of_each(), fmt::format("with {} a step has one projection, at its end", what),
             "write each step, or leave it out");
    } else {
      return has_stages(elaboration_, range_, "a constraint");
    }
    return false;
  }

  bool is_each_stage_asked_for() const {
    const Project project = elaboration_.problem.scheme.project;
    return project == Project::automatic ? item_.each && item_.each->name == "stage" : project == Project::stage;
  }
  SourceRange place_of_each() const { return item_.each ? item_.each->range : range_; }

  /// At sides, wide differences of the corrected field and of the multiplier would read different ghost cells.
  bool has_sides() const {
    return std::ranges::any_of(elaboration_.problem.axes,
                               [](const Axis& a) { return a.topology == Topology::bounded; }) ||
           std::ranges::any_of(elaboration_.problem.states, [](const State& state) { return state.held.has_value(); });
  }

  /// As the constraint says, unless the scheme's key overrides it.
  bool is_each_step_asked_for() const {
    const Project project = elaboration_.problem.scheme.project;
    return project == Project::automatic ? item_.each && item_.each->name == "step" : project == Project::step;
  }
  /// True if the stages before the last have no projection. Steps that project only once anyway stay as they are.
  bool is_each_step() const {
    const Scheme& scheme = elaboration_.problem.scheme;
    return is_each_step_asked_for() && has_several_stages(scheme.time) && !ends_with_projection(scheme);
  }
  static bool ends_with_projection(const Scheme& scheme) { return scheme.is_split() || scheme.is_semi_lagrangian(); }

  bool keeps_multiplier() const {
    const Scheme& scheme = elaboration_.problem.scheme;
    return (is_implicit(scheme.time) && !scheme.is_split()) || is_each_step();
  }

  /// Removes the multiplier from all right-hand sides. Implicit stages keep the one of the step before: they solve
  /// without the constraint, so next to walls the error is only the multiplier's change (van Kan 1986). Stages without
  /// a projection keep it, too.
  bool split_rates() {
    for (State& state : elaboration_.problem.states) {
      if (!state.rhs || state.name == name_ || !reads(*state.rhs, name_)) continue;
      Origin nonlinear;
      const std::optional<LinearPart> parts = linear_part(*state.rhs, name_, nonlinear);
      if (!parts || !state.velocity_of.empty()) {
        refuse_nonlinear(nonlinear, state.origin.range, name_,
                         fmt::format("the rates hold {0} in terms like -grad({0})", name_));
        return false;
      }
      changed_.push_back({&state, parts->part});
      if (!keeps_multiplier()) state.rhs = parts->rest;
    }
    const bool is_consequence = elaboration_.sink.has_errors();  // of an error in an equation
    if (changed_.empty() && !is_consequence)
      refuse(item_.multiplier.range, "no equation holds it", fmt::format("as in dt(u) = ... - grad({})", name_));
    return !changed_.empty();
  }

  /// The constraint with `e` substituted for the state: the part linear in `e`, and the rest.
  std::optional<LinearPart> put_in(const Expr& constraint, const std::string& state, const Expr& e) {
    Origin nonlinear;
    const auto parts = linear_part(constraint, state, nonlinear, e);
    if (!parts) refuse_nonlinear(nonlinear, range_, state, "a constraint is linear in the fields that it binds");
    return parts;
  }

  void add(const Expr& value, State& multiplier, const std::vector<Expr>& starts) {
    Expr operation = 0.0, found = value;  // action on the multiplier; uncorrected constraint
    for (const Changed& changed : changed_) {
      const std::string& state = changed.state->name;
      if (!reads(value, state)) continue;
      const auto moved = put_in(value, state, without_held(*changed.state, changed.push));
      const auto held = put_in(found, state, with_held(*changed.state, field(state)));
      if (!moved || !held) return;
      operation = binary(BinaryOp::add, operation, moved->part);
      found = binary(BinaryOp::add, held->part, held->rest);
    }
    if (is_literal(operation, 0))
      return refuse(item_.value.range(), "it binds no field whose rate holds the pressure", "");
    const auto boundary = derived_boundary(value);
    if (!boundary) return;
    multiplier.boundary = *boundary;
    Solve potential{name_, operation, negate(found), *boundary};
    if (!fits_waves(potential)) return;
    potential.starts = starts;
    if (!add_preconditioner(elaboration_, item_.preconditioner, potential)) return;
    if (!keeps_multiplier()) add_guesses_of_constraint(elaboration_, potential, {range_});  // increments differ
    if (keeps_multiplier()) refuse_starts(elaboration_, potential);
    using enum Projection::Kind;
    const Projection::Kind kind = is_each_step()       ? increment_each_step
                                  : keeps_multiplier() ? increment_each_stage
                                                       : each_stage;
    Projection made{name_, value, solve(potential, {range_}), kind, {}, {range_}};
    for (const Changed& changed : changed_) {
      Origin none;
      const std::string& state = changed.state->name;
      const Expr push = linear_part(changed.push, name_, none, *made.potential)->part;
      made.updates.push_back({state, with_held(*changed.state, binary(BinaryOp::add, field(state), push))});
    }
    if (made.is_each_step()) hold_between();
    elaboration_.problem.projections.push_back(std::move(made));
  }

  /// With Fourier series each mode is divided by the constraint applied to its own correction: exact to rounding. Waves
  /// of two cells, which have zero slope, stay unchanged.
  bool fits_waves(const Solve& potential) {
    const Scheme& scheme = elaboration_.problem.scheme;
    if (!holds_waves(potential, scheme) || is_of_waves(potential, scheme)) return true;
    refuse(item_.value.range(),
           "by Fourier series it is solved wave by wave, without masks, and with coefficients that are the same "
           "everywhere",
           "take dx and lap = central(2) and vector u on faces");
    return false;
  }

  /// Masks act in all stages.
  void hold_between() {
    Projection between;
    between.kind = Projection::Kind::between;
    for (const Changed& changed : changed_) {
      const State& state = *changed.state;
      if (state.held) between.updates.push_back({state.name, with_held(state, field(state.name))});
    }
    if (!between.updates.empty()) elaboration_.problem.projections.push_back(std::move(between));
  }

  /// On a wall where the corrected field has a given value, the multiplier does not change it; at an outflow the
  /// multiplier is 0.
  std::optional<std::vector<AxisSides>> derived_boundary(const Expr& value) {
    std::vector<AxisSides> boundary(elaboration_.problem.axes.size());
    for (std::size_t axis = 0; axis < boundary.size(); ++axis) {
      const State* across = nullptr;
      for (const Changed& changed : changed_) {
        const bool is_bound = reads(value, changed.state->name);
        if (is_bound && changed.state->placement[axis]) across = changed.state;
      }
      const Axis& along = elaboration_.problem.axes[axis];
      const bool are_waves =
          elaboration_.problem.scheme.derivative_order == spectral;  // check_waves ensures periodic axes
      if (!across && !are_waves) {
        refuse(range_, fmt::format("no field of the constraint lies on the faces across {}", along.name),
               "declare the velocity with vector u on faces, or take dx = spectral in the scheme");
        return std::nullopt;
      }
      if (along.topology == Topology::periodic) continue;
      for (const auto side : {&AxisSides::low, &AxisSides::high}) {
        const SideCondition& wall = condition_of((across->boundary[axis].*side).kind);
        const std::string place = along.name + (side == &AxisSides::low ? ".low" : ".high");
        if (!wall.gives_value() && !wall.keeps_wall()) {
          refuse(boundary_of_side(elaboration_, across->name, place).value_or(range_),
                 fmt::format("{} has no value at {}", across->name, place),
                 fmt::format("write boundary {}: {} = 0{}", across->name, place,
                             along.holds_wall(side == &AxisSides::low) ? ", or = outflow" : ""));
          return std::nullopt;
        }
        boundary[axis].*side = Side{wall.keeps_wall() ? SideKind::value : SideKind::zero_gradient};
      }
    }
    return boundary;
  }

  Elaboration& elaboration_;
  const ast::ConstraintItem& item_;
  SourceRange range_;
  std::string name_;
  std::vector<Changed> changed_;
};

void bind_held(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen;
  std::vector<std::string> masks;
  for (const Coefficient& coefficient : elaboration.problem.coefficients) {
    if (coefficient.is_mask) masks.push_back(coefficient.name);
  }
  for (const auto& [mask, inside] : elaboration.masks.moving) masks.push_back(mask);
  for (const auto& [item, range] : items_of<ast::HeldItem>(elaboration.blocks.model->items)) {
    if (std::ranges::find(masks, item.mask.name) == masks.end()) {
      const std::string near = did_you_mean(item.mask.name, masks);
      elaboration.sink.report("not-a-mask", item.mask.range, {item.mask.name},
                              near.empty() ? "declare it with mask " + item.mask.name : near);
      continue;
    }
    const std::vector<State*> states = find_states(elaboration, item.field, "a value inside a mask");
    if (states.empty() || !is_first(elaboration, "the value inside a mask", item.field, states, seen)) continue;
    if (elaboration.solves.multipliers.contains(item.field.name)) {
      elaboration.sink.report("not-allowed-here", item.field.range, {"a field that a constraint gives", "a mask"},
                              "write values for the fields of the constraint");
      continue;
    }
    elaboration.params.used.insert(item.mask.name);
    const auto values =
        formulas::components({elaboration, FormulaContext::equation, item.field.name}, item.value, item.field.name);
    for (std::size_t i = 0; values && i < states.size(); ++i) {
      const Expr inside = inside_at(elaboration, *states[i], item.mask.name, {item.mask.range});
      states[i]->held = MaskedValue{inside, (*values)[i]};
      if (states[i]->rhs)
        elaboration.masks.forces.emplace(states[i]->name,
                                         MaskForce{item.mask.name, select(inside, *states[i]->rhs, 0.0)});
    }
  }
}

}  // namespace

void bind_projections(Elaboration& elaboration) {
  bind_held(elaboration);
  for (const auto& [item, range] : items_of<ast::ConstraintItem>(elaboration.blocks.model->items)) {
    if (!is_refused_in_curves(elaboration, "a constraint", range)) Binder(elaboration, item, range).bind();
  }
  Projection alone;
  for (const State& state : elaboration.problem.states) {
    if (state.held && !elaboration.problem.is_projected(state.name))
      alone.updates.push_back({state.name, with_held(state, field(state.name))});
  }
  if (alone.updates.empty()) return;
  const SourceRange range = items_of<ast::HeldItem>(elaboration.blocks.model->items).front().range;
  if (has_stages(elaboration, range, "a mask")) elaboration.problem.projections.push_back(std::move(alone));
}

/// Refuses a projected initial state with missing derivatives.
void check_projected_starts(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  // The adjoint of the initial state does not include dependence through coefficients.
  const auto is_sought = [&](const Unknown& unknown) {
    const auto is_it = [&](const Expr& e) {
      const Param* param = as<Param>(e);
      return (param != nullptr && param->name == unknown.name) ||
             (unknown.kind == Unknown::Kind::network && is<NetworkCall>(e));
    };
    const auto holds_it = [&](const Coefficient& c) { return c.value.formula && any_part(*c.value.formula, is_it); };
    return unknown.kind == Unknown::Kind::coefficient || unknown.kind == Unknown::Kind::control ||
           std::ranges::any_of(problem.coefficients, holds_it);
  };
  for (const State& state : problem.states) {
    if (!state.projected) continue;
    const auto refuse = [&](std::string in, std::string hint) {
      elaboration.sink.report("not-allowed-here", state.projected->range, {"projected", std::move(in)},
                              std::move(hint));
    };
    const auto binds = [&](const Projection& projection) {
      return projection.potential &&
             std::ranges::find(projection.updates, state.name, &Event::Update::state) != projection.updates.end();
    };
    const auto by = std::ranges::find_if(problem.projections, binds);
    if (by == problem.projections.end())
      return refuse(fmt::format("the initial state of {}, which no constraint binds", state.name), "leave it out");
    const auto has_formula = [&](const std::string& name) {
      const State* other = problem.find_state(name);
      return other->initial.formula && (other->projected || name == by->multiplier);
    };
    const bool all = std::ranges::all_of(by->updates, [&](const auto& update) { return has_formula(update.state); });
    if (!all || !has_formula(by->multiplier))
      return refuse("a scene where fields of the constraint begin with a file or without it",
                    "give each of them a formula and write projected after it, or leave it out everywhere");
    if (problem.task && std::ranges::any_of(problem.task->unknowns, is_sought))
      return refuse(
          "a task with an unknown coefficient, an unknown in the formula of a coefficient, or an unknown control",
          "leave it out: the first step makes the constraint true, and has derivatives by all of these");
  }
}

}  // namespace dpde::model
