// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/unread_boundaries.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "model/build.h"
#include "model/uses.h"
#include "stencil/build.h"
#include "stencil/space/quantities.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::stencil {

namespace {

/// A value for each side (low, high) of each axis.
template <class T>
using OfSides = std::array<std::array<T, 2>, max_rank>;

/// The fields that equations, losses and the like read beyond walls.
class Readers {
 public:
  explicit Readers(const Lowering& lowering) : lowering_(lowering), problem_(lowering.problem()) {
    model::for_each_formula(problem_, [&](const model::Use& use) { add(use); });
  }

  bool in_step(const std::string& field, int axis, bool is_high) const { return is_in(in_step_, field, axis, is_high); }
  bool anywhere(const std::string& field, int axis, bool is_high) const {
    return in_step(field, axis, is_high) || is_in(elsewhere_, field, axis, is_high);
  }
  /// A state with points on the wall whose equation, if evaluated there, would read the condition; "" if there is none.
  std::string on_wall(const std::string& field, int axis, bool is_high) const {
    const auto found = on_wall_.find(field);
    return found == on_wall_.end() ? "" : found->second[static_cast<std::size_t>(axis)][is_high ? 1 : 0];
  }

 private:
  using Sides = std::map<std::string, OfSides<bool>>;

  static bool is_in(const Sides& sides, const std::string& field, int axis, bool is_high) {
    const auto found = sides.find(field);
    return found != sides.end() && found->second[static_cast<std::size_t>(axis)][is_high ? 1 : 0];
  }

  static void visit_all(const Expr& value, const Discretiser& at_point, const std::function<void(const Expr&)>& f) {
    visit(value, f);
    for (const Let& let : at_point.lets()) visit(let.value, f);
  }

  bool is_on_walls(const model::State& state, int axis) const {
    return state.placement[static_cast<std::size_t>(axis)] &&
           problem_.axes[static_cast<std::size_t>(axis)].topology == Topology::bounded;
  }

  void add(const model::Use& use) {
    using enum model::UseKind;
    switch (use.kind) {
      case equation:
      case correction:
      case event: return add_to_state(*problem_.find_state(use.owner), use.formula);
      case held_where:
      case held_value: return;  // part of a correction
      case potential:
      case constraint:
      case courant_rate: return add_field(use.formula, use.home, in_step_);
      case output: return add_field(use.formula, use.home, elsewhere_);
      case test_field: return add_field(use.formula, natural(use.formula), elsewhere_);
      case observable:
      case loss:
      case test: return add_sums(use.formula);
      case initial:
      case coefficient:
      case control:
      case control_start:
      case unknown_start:
      case exact:
      case boundary_value:
      case boundary_weight:
      case stretch_map:
      case metric: return;           // these read no neighbours
      case stated_operator: return;  // never run
    }
  }

  model::Placement natural(const model::Expr& e) const {
    return model::Placements(problem_).natural(e).value_or(model::Placement{});
  }

  /// Equations are not evaluated at points on walls.
  void add_to_state(const model::State& state, const model::Expr& e) {
    Discretiser at_point = lowering_.discretiser();
    const Expr value = at_point(e, state.placement);
    visit_all(value, at_point, [&](const Expr& part) {
      note(part, in_step_, [&](int axis) { return is_on_walls(state, axis) ? 1 : 0; });
      const Access* access = as<Access>(part);
      for (int axis = 0; access && axis < lowering_.rank(); ++axis) {
        const int offset = access->offset[static_cast<std::size_t>(axis)];
        if (!is_on_walls(state, axis)) continue;
        std::array<std::string, 2>& walls = on_wall_[access->field][static_cast<std::size_t>(axis)];
        if (offset <= 0) walls[0] = state.name;
        if (offset > 0) walls[1] = state.name;
      }
    });
    note_preparations(at_point, in_step_);
  }

  void add_field(const model::Expr& e, const model::Placement& home, Sides& sides) {
    Discretiser at_point = lowering_.discretiser();
    const Expr value = at_point(e, home);
    add_all(value, at_point, sides);
  }

  void add_sums(const model::Expr& quantity) {
    Discretiser at_point = lowering_.discretiser();
    const Expr value = cell_share(quantity, lowering_.rank(), at_point);
    add_all(value, at_point, elsewhere_);
  }

  void add_all(const Expr& value, const Discretiser& at_point, Sides& sides) {
    visit_all(value, at_point, [&](const Expr& part) { note(part, sides, [](int) { return 0; }); });
    note_preparations(at_point, sides);
  }

  /// `last(axis)`: number of cells between the last point and the last cell.
  void note(const Expr& part, Sides& sides, const std::function<int(int)>& last) {
    if (const Interp* interp = as<Interp>(part)) return note_all(interp->field, sides);
    const Access* access = as<Access>(part);
    for (int axis = 0; access && axis < lowering_.rank(); ++axis) {
      const int offset = access->offset[static_cast<std::size_t>(axis)];
      std::array<bool, 2>& along = of(access->field, sides)[static_cast<std::size_t>(axis)];
      along[0] = along[0] || offset < 0;
      along[1] = along[1] || offset > last(axis);
    }
  }

  /// Preparations may be computed beyond walls too: all their inputs count as read there.
  void note_preparations(const Discretiser& at_point, Sides& sides) {
    const auto note_reads = [&](const Kernel& kernel) {
      for (const Signature::Read& read : signature(kernel).reads) note_all(read.field, sides);
    };
    for (const Prerequisite& preparation : at_point.preparations()) {
      match(
          preparation, note_reads, ignored<Reduce, Transform>,  // these read the interior and periodic axes only
          [&](const NetworkCall& call) {
            for (const std::string& input : call.inputs) note_all(input, sides);
          },
          [&](const PreparedSolve& solve) { note_reads(solve.kernel); });
    }
  }

  void note_all(const std::string& field, Sides& sides) {
    for (std::array<bool, 2>& along : of(field, sides)) along = {true, true};
  }

  /// dt(u) has the boundary of u.
  OfSides<bool>& of(const std::string& field, Sides& sides) const {
    const model::State* state = problem_.find_state(field);
    return sides[state && !state->velocity_of.empty() ? state->velocity_of : field];
  }

  const Lowering& lowering_;
  const model::Problem& problem_;
  Sides in_step_, elsewhere_;
  std::map<std::string, OfSides<std::string>> on_wall_;
};

bool asks_for_something(const model::Side& side) {
  return (condition_of(side.kind).a != SideCondition::Part::zero && !condition_of(side.kind).turns()) ||
         !is_literal(side.value, 0);
}

bool has_no_slope(const model::Side& side) {
  const bool is_slope = side.kind == SideKind::zero_gradient || condition_of(side.kind).gives_slope();
  return is_slope && is_literal(side.value, 0);
}

/// Source range of the condition.
SourceRange range_of(const model::State& state, const model::Side& side) {
  const SourceRange range = side.value->origin.range;
  return range.is_known() ? range : state.origin.range;
}

/// Whether the condition depends on time, a control variable or a field.
bool varies(const model::Problem& problem, const model::Side& side) {
  const auto is_varying = [&](const model::Expr& part) {
    const auto* param = as<model::Param>(part);
    const model::Parameter* known = param ? problem.find_param(param->name) : nullptr;
    return is<model::Field>(part) || (param && (param->name == "t" || problem.find_control(param->name))) ||
           (known && known->unknown);
  };
  return any_part(side.value, is_varying) || any_part(side.a, is_varying) || any_part(side.b, is_varying);
}

using WallPlace = std::array<double, max_rank>;

/// Value at a point of a formula of numbers, parameters and coordinates; nullopt for other formulas, or if the value is
/// not a number.
std::optional<double> number_at(const model::Problem& problem, const model::Expr& e, const WallPlace& place) {
  const auto at = [&](const model::Expr& part) { return number_at(problem, part, place); };
  std::optional<double> value;
  if (const auto* number = as<model::Number>(e)) value = number->value;
  if (const auto* coordinate = as<model::Coordinate>(e)) {
    value = place[static_cast<std::size_t>(coordinate->axis)];
  }
  if (const auto* param = as<model::Param>(e)) {
    const model::Parameter* known = problem.find_param(param->name);
    if (known != nullptr && !known->unknown) value = known->value;
  }
  if (const auto* neg = as<model::Neg>(e)) {
    if (const auto operand = at(neg->operand)) value = -*operand;
  }
  if (const auto* b = as<model::Binary>(e)) {
    const auto left = at(b->left), right = at(b->right);
    if (left && right) value = evaluate_binary(b->op, *left, *right);
  }
  if (const auto* call = as<model::Call>(e)) {
    const auto first = at(call->arguments.front());
    const auto second = call->arguments.size() > 1 ? at(call->arguments[1]) : std::optional(0.0);
    if (first && second) value = evaluate_call(call->fn, *first, *second);
  }
  if (const auto* select = as<model::Select>(e)) {
    if (const auto condition = at(select->condition)) return at(*condition != 0 ? select->yes : select->no);
  }
  return value && std::isfinite(*value) ? value : std::nullopt;
}

bool is_sought(const model::Problem& problem, const model::State& state) {
  return problem.task && std::ranges::any_of(problem.task->unknowns, [&](const model::Unknown& unknown) {
           return unknown.kind == model::Unknown::Kind::initial && unknown.name == state.name;
         });
}

/// False if the initial value of the state at the wall is known to differ from the value of the condition.
bool may_begin_with(const model::Problem& problem, const model::State& state, int axis, bool is_high,
                    const model::Side& side) {
  if (!condition_of(side.kind).gives_value()) return false;
  if (!state.initial.formula || is_sought(problem, state)) return true;
  for (const double part : {0.1, 0.5, 0.8}) {  // along the wall
    WallPlace place{};
    for (std::size_t a = 0; a < problem.axes.size(); ++a) {
      const model::Axis& along = problem.axes[a];
      place[a] = along.low + part * (along.high - along.low);
      if (static_cast<int>(a) == axis) place[a] = is_high ? along.high : along.low;
    }
    const std::optional<double> begin = number_at(problem, *state.initial.formula, place),
                                wanted = number_at(problem, side.value, place);
    if (begin && wanted && std::abs(*begin - *wanted) > 1e-9 * std::max(1.0, std::abs(*wanted))) return false;
  }
  return true;
}

/// A condition that is not read: one side of one field.
struct Idle {
  const model::State& state;
  int axis = 0;
  bool is_high = false;
  const model::State* holder = nullptr;  // the state on the wall whose equation would have read the condition

  const model::Side& of(const model::State& any) const {
    const model::AxisSides& sides = any.boundary[static_cast<std::size_t>(axis)];
    return is_high ? sides.high : sides.low;
  }
};

void report(const model::Problem& problem, const Idle& idle, DiagnosticSink& sink) {
  const model::Side& side = idle.of(idle.state);
  const std::string &name = idle.state.name,
                    place = side_name(problem.axes[static_cast<std::size_t>(idle.axis)], !idle.is_high);
  if (!idle.holder) {
    sink.report("idle-boundary", range_of(idle.state, side), {name, place},
                "write zero_gradient, which asks for nothing");
    return;
  }
  const std::string& holder = idle.holder->name;
  // An open end: where the flux has zero slope, the transported state is constant.
  if (has_no_slope(idle.of(*idle.holder)) && !varies(problem, side)) {
    const std::string hint = fmt::format(
        "where {} has no slope, {} on the wall stays what it begins with: write zero_gradient", holder, name);
    if (may_begin_with(problem, idle.state, idle.axis, idle.is_high, side)) {
      sink.report("idle-boundary", range_of(idle.state, side), {name, place}, hint);
    } else {
      sink.report("boundary-not-read", range_of(idle.state, side), {name, place, holder},
                  fmt::format("{} here, and let the initial {} be what it is to be there", hint, name));
    }
    return;
  }
  sink.report("boundary-not-read", range_of(idle.state, side), {name, place, holder},
              fmt::format("write zero_gradient here, and what holds on the wall into the boundary of {1}: with dt({0}) "
                          "= -c*div({1}), {0} is L(t) there where {1}: {2} = gradient({3}L'(t)/c)",
                          name, holder, place, idle.is_high ? "-" : ""));
}

/// All conditions, except of zero slope, that are not read.
std::vector<Idle> unread_boundaries(const Lowering& lowering) {
  std::vector<Idle> found;
  const model::Problem& problem = lowering.problem();
  if (!problem.program.empty() || problem.scheme.is_semi_lagrangian())
    return found;  // departure points may lie anywhere
  const Readers readers(lowering);
  for (const model::State& state : problem.states) {
    const bool is_stated = state.velocity_of.empty() && problem.find_projection(state.name) == nullptr;
    if (!state.rhs || !is_stated) continue;
    for (int axis = 0; axis < lowering.rank(); ++axis) {
      if (problem.axes[static_cast<std::size_t>(axis)].topology == Topology::periodic ||
          state.placement[static_cast<std::size_t>(axis)])
        continue;
      for (const bool is_high : {false, true}) {
        const Idle idle{state, axis, is_high, problem.find_state(readers.on_wall(state.name, axis, is_high))};
        const bool is_read =
            idle.holder ? readers.in_step(state.name, axis, is_high) : readers.anywhere(state.name, axis, is_high);
        if (!is_read && asks_for_something(idle.of(state))) found.push_back(idle);
      }
    }
  }
  return found;
}

}  // namespace

void check_idle_walls(const Lowering& lowering, DiagnosticSink& sink) {
  std::map<std::string, std::vector<SourceRange>> told;  // by state
  for (const Idle& idle : unread_boundaries(lowering)) {
    std::vector<SourceRange>& of_state = told[idle.state.name];
    const SourceRange range = range_of(idle.state, idle.of(idle.state));
    if (std::ranges::count(of_state, range) > 0) continue;
    of_state.push_back(range);
    report(lowering.problem(), idle, sink);
  }
}

model::Problem without_idle_walls(const model::Problem& problem) {
  model::Problem result = problem;
  for (const Idle& idle : unread_boundaries(Lowering(problem))) {
    const auto state = std::ranges::find(result.states, idle.state.name, &model::State::name);
    model::AxisSides& sides = state->boundary[static_cast<std::size_t>(idle.axis)];
    (idle.is_high ? sides.high : sides.low) = {.kind = SideKind::zero_gradient};
  }
  return result;
}

}  // namespace dpde::stencil
