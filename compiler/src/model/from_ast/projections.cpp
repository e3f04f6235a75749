// SPDX-License-Identifier: Apache-2.0
// 0 = div(u) gives p: the field p in the rates of u is what keeps div(u) at 0. A stage of a step takes the rates
// without p and then u + G(phi), where G(p) is what stood in the rate and C(u + G(phi)) = 0 for the constraint C: phi
// is p times the time over which the rates were taken (Chorin 1968; of the order of the Runge-Kutta method where each
// stage does it, Sanderse and Koren 2012).
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"
#include "model/placement.h"
#include "model/print_model.h"

namespace dpde::model {

namespace {

class Binder {
 public:
  Binder(Draft& draft, const ast::ConstraintItem& item, SourceRange range)
      : draft_(draft), item_(item), range_(range), name_(item.multiplier.name) {}

  void bind() {
    const auto value = Expressions(draft_, Purpose::equation, name_).number(item_.value);
    const auto* zero = std::get_if<ast::Number>(&item_.zero->kind);
    if (!zero || zero->value != 0)
      return refuse(item_.zero.range(), "the left side of a constraint is 0", "write 0 = div(u) gives " + name_);
    const auto multiplier = std::ranges::find(draft_.problem.states, name_, &State::name);
    if (!value || multiplier == draft_.problem.states.end() || !fits(*multiplier) || !split_rates()) return;
    if (reads(*value, name_))
      return refuse(item_.value.range(), "the constraint itself holds it", "write it with the fields that it binds");
    add(*value, *multiplier);
  }

 private:
  struct Changed {
    State* state;
    Expr push;  // what it has of the multiplier in its rate
  };

  void refuse(SourceRange at, std::string why, std::string hint) {
    draft_.sink.report("constraint-does-not-fit", at, {name_, std::move(why)}, std::move(hint));
  }

  bool fits(const State& multiplier) {
    const Scheme& scheme = draft_.problem.scheme;
    if (multiplier.placement != Placement{}) {
      refuse(item_.multiplier.range, "it does not lie at the cell centres", "write field " + name_);
    } else if (is_exponential(scheme.time) || scheme.time == TimeScheme::verlet ||
               scheme.time == TimeScheme::leapfrog || follows_flow(scheme.advect)) {
      draft_.sink.report("schemes-do-not-fit", range_, {print(scheme.time), "a constraint"},
                         "take time = rk4, ssp_rk3 or ab2, and advect = central(2) or upwind(3)");
    } else if (scheme.derivative_order == spectral || scheme.laplacian_order == spectral) {
      refuse(range_, "derivatives by Fourier series are in no solve", "take dx and lap = central(2) in the scheme");
    } else {
      return true;
    }
    return false;
  }

  /// Takes the multiplier out of all rates.
  bool split_rates() {
    for (State& state : draft_.problem.states) {
      if (!state.rhs || state.name == name_ || !reads(*state.rhs, name_)) continue;
      Origin nonlinear;
      const std::optional<LinearPart> parts = linear_part(*state.rhs, name_, nonlinear);
      if (!parts || !state.velocity_of.empty()) {
        draft_.sink.report("not-linear-in", nonlinear.range.is_known() ? nonlinear.range : state.origin.range, {name_},
                           fmt::format("the rates hold {} by terms like -grad({})", name_, name_));
        return false;
      }
      changed_.push_back({&state, parts->part});
      state.rhs = parts->rest;
    }
    if (changed_.empty())
      refuse(item_.multiplier.range, "no equation holds it", fmt::format("as in dt(u) = ... - grad({})", name_));
    return !changed_.empty();
  }

  void add(const Expr& value, State& multiplier) {
    std::optional<Expr> operation;
    for (const Changed& changed : changed_) {
      if (!reads(value, changed.state->name)) continue;
      Origin nonlinear;
      const std::optional<LinearPart> part = linear_part(value, changed.state->name, nonlinear, changed.push);
      if (!part) {
        draft_.sink.report("not-linear-in", nonlinear.range.is_known() ? nonlinear.range : range_,
                           {changed.state->name}, "a constraint is linear in the fields that it binds");
        return;
      }
      operation = operation ? binary(BinaryOp::add, *operation, part->part) : part->part;
    }
    if (!operation) return refuse(item_.value.range(), "the constraint holds no field whose rate it stands in", "");
    const auto boundary = derived_boundary(value);
    if (!boundary) return;
    multiplier.boundary = *boundary;
    Projection made{name_, solve({name_, *operation, negate(value), *boundary}, {range_}), {}, {range_}};
    for (const Changed& changed : changed_) {
      Origin none;
      const Expr push = linear_part(changed.push, name_, none, made.potential)->part;
      made.updates.push_back({changed.state->name, binary(BinaryOp::add, field(changed.state->name), push)});
    }
    draft_.problem.projections.push_back(std::move(made));
  }

  /// Where what lies on a wall has a value there, the multiplier does not change it.
  std::optional<std::vector<AxisSides>> derived_boundary(const Expr& value) {
    std::vector<AxisSides> boundary(draft_.problem.axes.size());
    for (std::size_t axis = 0; axis < boundary.size(); ++axis) {
      const State* across = nullptr;
      for (const Changed& changed : changed_) {
        const bool is_bound = reads(value, changed.state->name);
        if (is_bound && changed.state->placement[axis]) across = changed.state;
      }
      const Axis& along = draft_.problem.axes[axis];
      if (!across) {
        refuse(range_, fmt::format("no field of the constraint lies on the faces across {}", along.name),
               "declare the velocity with vector u on faces");
        return std::nullopt;
      }
      if (along.topology == Topology::periodic) continue;
      for (const auto side : {&AxisSides::low, &AxisSides::high}) {
        if (!condition_of((across->boundary[axis].*side).kind).gives_value()) {
          refuse(range_,
                 fmt::format("{} has no value at {}.{}", across->name, along.name,
                             side == &AxisSides::low ? "low" : "high"),
                 fmt::format("write boundary {}: {}.{} = 0", across->name, along.name,
                             side == &AxisSides::low ? "low" : "high"));
          return std::nullopt;
        }
        boundary[axis].*side = Side{SideKind::zero_gradient};
      }
    }
    return boundary;
  }

  Draft& draft_;
  const ast::ConstraintItem& item_;
  SourceRange range_;
  std::string name_;
  std::vector<Changed> changed_;
};

}  // namespace

void bind_projections(Draft& draft) {
  for (const auto& [item, range] : items_of<ast::ConstraintItem>(draft.model->items)) Binder(draft, item, range).bind();
}

}  // namespace dpde::model
