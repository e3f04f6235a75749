// SPDX-License-Identifier: Apache-2.0
#include "stencil/semi_lagrangian.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/time_schemes.h"

namespace dpde::stencil {

namespace {

using model::Term;

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
  const std::vector<Term> terms = model::terms_of(*state.rhs);
  for (const Term& term : terms) {
    if (const model::Advect* advect = as_advect(term.value)) return advect;  // lives as long as the equation
  }
  return nullptr;
}

void check_state(const model::State& state, DiagnosticSink& sink) {
  const std::vector<Term> terms = model::terms_of(*state.rhs);
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

bool has_moving_walls(const model::Problem& problem, const model::State& state) {
  const auto moves = [&](const model::Expr& part) {
    const auto* param = std::get_if<model::Param>(&part->kind);
    return param && (param->name == "t" || problem.find_control(param->name) != nullptr);
  };
  return std::any_of(state.boundary.begin(), state.boundary.end(), [&](const model::AxisSides& sides) {
    return model::any_part(sides.low.value, moves) || model::any_part(sides.high.value, moves);
  });
}

/// MacCormack takes velocities at both ends of the step from states whose halos are filled for the later one: a
/// velocity made of differences would see a wall that moves at the wrong time.
void check_velocity(const model::Problem& problem, const model::State& state, DiagnosticSink& sink) {
  const model::Advect* transport = find_transport(state);
  if (!transport) return;
  for (const model::State& read : problem.states) {
    if (!has_moving_walls(problem, read)) continue;
    const auto looks_around = [&](const model::Expr& part) {
      const bool is_difference = std::holds_alternative<model::Derivative>(part->kind) ||
                                 std::holds_alternative<model::Interpolate>(part->kind) ||
                                 std::holds_alternative<model::Shift>(part->kind);
      return is_difference && model::reads(part, read.name);
    };
    for (const model::Expr& component : transport->velocity) {
      if (!model::any_part(component, looks_around)) continue;
      sink.report(
          "not-allowed-here", component->origin.range.is_known() ? component->origin.range : state.origin.range,
          {"a velocity with differences of " + read.name + ", whose walls move,", "a scene with advect = maccormack"},
          "take advect = semi_lagrangian or upwind(3)");
      return;
    }
  }
}

/// The way of the flow in a step, backwards or forwards, in cells.
std::vector<Expr> way(const model::Advect& advect, bool backwards, Discretiser& at_point) {
  std::vector<Expr> result;
  for (int axis = 0; axis < static_cast<int>(advect.velocity.size()); ++axis) {
    const Expr cells = param("dt") * at_point(advect.velocity[axis]) / spacing(axis);
    result.push_back(backwards ? -cells : cells);
  }
  return result;
}

std::vector<Expr> shared_way(const std::string& wish, std::vector<Expr> way, Discretiser& at_point) {
  for (std::size_t axis = 0; axis < way.size(); ++axis) {
    way[axis] = at_point.shared(wish + "_" + axis_letter(static_cast<int>(axis)), way[axis]);
  }
  return way;
}

Expr taken(const std::string& field, const std::vector<Expr>& way, Along along) {
  Interp value{field, {}, way, {}};
  std::fill_n(value.along.begin(), way.size(), along);
  return interp(value);
}

Along interpolation(const model::Problem& problem) {
  return problem.scheme.advect == model::Advection::semi_lagrangian && problem.scheme.advect_order == 3 ? Along::cubic
                                                                                                        : Along::linear;
}

/// The least and the greatest of the corners of the cell that `way` leads to.
struct Bounds {
  Expr least, greatest;
};

Bounds bounds_at(const std::string& field, const std::vector<Expr>& way, Discretiser& at_point) {
  std::optional<Bounds> bounds;
  for (int corner = 0; corner < 1 << way.size(); ++corner) {
    Interp read{field, {}, way, {}};
    for (std::size_t axis = 0; axis < way.size(); ++axis)
      read.along[axis] = corner >> axis & 1 ? Along::upper : Along::lower;
    const Expr value = at_point.shared(field + "_corner", interp(read));
    if (!bounds) {
      bounds = {value, value};
      continue;
    }
    bounds = {at_point.shared(field + "_least", call(Fn::min, {bounds->least, value})),
              at_point.shared(field + "_greatest", call(Fn::max, {bounds->greatest, value}))};
  }
  return *bounds;
}

/// `value` where neither way leads beyond a wall, else 0.
Expr within_walls(Expr value, const std::vector<model::Axis>& axes, const std::vector<Expr>& back,
                  const std::vector<Expr>& forth) {
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis].topology == Topology::periodic) continue;
    const Expr place = access(axis_letter(static_cast<int>(axis)));
    const Expr room =
        call(Fn::min, {place - axes[axis].low, axes[axis].high - place}) / spacing(static_cast<int>(axis));
    const Expr longest = call(Fn::max, {call(Fn::abs, {back[axis]}), call(Fn::abs, {forth[axis]})});
    value = select(binary(BinaryOp::less_equal, longest, room), value, 0.0);
  }
  return value;
}

/// What the states are called in the parts of a step.
using Fields = std::map<std::string, std::string>;

std::string name_in(const Fields& fields, const std::string& state) {
  const auto found = fields.find(state);
  return found == fields.end() ? state : found->second;
}

/// All terms but transport, by the time integrator; `mid` gets the names of the fields that hold the states then.
std::vector<Stage> stages_of_terms(Lowering& lowering, Fields& mid) {
  std::vector<Advance> advances;
  for (const model::State& state : lowering.problem().states) {
    const std::optional<model::Expr> terms = without_transport(*state.rhs);
    if (!terms || model::is_constant(*terms, 0)) continue;
    mid[state.name] = lowering.field_beside(state.name, "mid");
    advances.push_back({state.name, *terms, mid[state.name], state.origin});
  }
  if (advances.empty()) return {};
  const std::string& scene = lowering.problem().scene;
  return time_stages(lowering, advances, scene + "_terms", scene);
}

Stage semi_lagrangian_stage(const Lowering& lowering, const Fields& mid, const std::vector<std::string>& into) {
  const model::Problem& problem = lowering.problem();
  Reading reading;
  reading.fields = mid;
  reading.time = param("t") + param("dt");
  Discretiser at_point = lowering.discretiser(reading);
  Kernel kernel = lowering.kernel(problem.scene + "_advect");
  for (std::size_t i = 0; i < into.size(); ++i) {
    const model::State& state = problem.states[i];
    const std::string field = name_in(mid, state.name);
    const model::Advect* transport = find_transport(state);
    const Expr value =
        transport ? taken(field, way(*transport, true, at_point), interpolation(problem)) : access(field);
    kernel.stores.push_back({into[i], false, value, state.origin});
  }
  return Lowering::stage(std::move(kernel), at_point, reading.time);
}

/// The step forwards with the velocity where it begins; `ahead` gets the names of its results.
Stage prediction(Lowering& lowering, const Fields& mid, Fields& ahead) {
  const model::Problem& problem = lowering.problem();
  Discretiser at_point = lowering.discretiser();
  Kernel kernel = lowering.kernel(problem.scene + "_advect");
  ahead = mid;
  for (const model::State& state : problem.states) {
    const model::Advect* transport = find_transport(state);
    if (!transport) continue;
    ahead[state.name] = lowering.field_beside(state.name, "ahead");
    const Expr value = taken(name_in(mid, state.name), way(*transport, true, at_point), interpolation(problem));
    kernel.stores.push_back({ahead[state.name], false, value, state.origin});
  }
  return Lowering::stage(std::move(kernel), at_point, param("t") + param("dt"));
}

/// What a velocity depends on.
bool is_of_states(const model::Problem& problem, const model::Advect& advect) {
  return std::ranges::any_of(advect.velocity, [&](const model::Expr& e) {
    return std::ranges::any_of(problem.states, [&](const model::State& state) { return model::reads(e, state.name); });
  });
}

bool is_of_time(const model::Advect& advect) {
  return std::ranges::any_of(advect.velocity, [](const model::Expr& e) {
    return model::any_part(e, [](const model::Expr& part) {
      const auto* param = std::get_if<model::Param>(&part->kind);
      return param && param->name == "t";
    });
  });
}

/// The same everywhere and all the time: the way is known as it is.
bool is_constant(const model::Advect& advect) {
  return !is_of_time(advect) && std::ranges::all_of(advect.velocity, model::is_uniform);
}

/// The ways back with the velocities where the step begins, as fields: one set for all states that are carried alike.
class Ways {
 public:
  Ways(Lowering& lowering, const std::string& scene)
      : lowering_(lowering), at_point_(lowering.discretiser()), kernel_(lowering.kernel(scene + "_trace")) {}

  const std::vector<std::string>& of(const model::Advect& transport, const Origin& origin) {
    for (const auto& [velocity, fields] : known_) {
      if (velocity == transport.velocity) return fields;
    }
    const std::vector<Expr> back = way(transport, true, at_point_);
    std::vector<std::string> fields;
    for (std::size_t axis = 0; axis < back.size(); ++axis) {
      fields.push_back(lowering_.fresh_field("way_" + axis_letter(static_cast<int>(axis))));
      kernel_.stores.push_back({fields.back(), false, back[axis], origin});
    }
    return known_.emplace_back(transport.velocity, std::move(fields)).second;
  }
  Stage stage() { return Lowering::stage(std::move(kernel_), at_point_, param("t") + param("dt")); }

 private:
  Lowering& lowering_;
  Discretiser at_point_;
  Kernel kernel_;
  std::vector<std::pair<std::vector<model::Expr>, std::vector<std::string>>> known_;
};

/// Departure points of second order: the way back is the mean of that with the velocity where and when the step ends,
/// and of that with the velocity where the former leads to, when the step begins.
std::vector<Stage> traced_stages(Lowering& lowering, const Fields& mid, const std::vector<std::string>& into) {
  const model::Problem& problem = lowering.problem();
  std::vector<Stage> stages;
  Fields ahead = mid;
  const auto looks_at_states = [&](const model::State& state) {
    const model::Advect* transport = find_transport(state);
    return transport && is_of_states(problem, *transport);
  };
  if (std::ranges::any_of(problem.states, looks_at_states)) stages.push_back(prediction(lowering, mid, ahead));
  Ways ways(lowering, problem.scene);
  Reading reading;
  reading.fields = ahead;
  reading.time = param("t") + param("dt");
  Discretiser at_point = lowering.discretiser(reading);
  Kernel kernel = lowering.kernel(problem.scene + "_carry");
  for (std::size_t i = 0; i < into.size(); ++i) {
    const model::State& state = problem.states[i];
    Expr value = access(name_in(mid, state.name));
    if (const model::Advect* transport = find_transport(state)) {
      std::vector<Expr> back;
      if (is_constant(*transport)) {
        back = way(*transport, true, at_point);
      } else {
        const std::vector<std::string>& fields = ways.of(*transport, state.origin);
        const bool is_steady = !is_of_time(*transport) && !is_of_states(problem, *transport);
        for (std::size_t axis = 0; axis < fields.size() && is_steady; ++axis) back.push_back(access(fields[axis]));
        if (!is_steady) back = shared_way("back", way(*transport, true, at_point), at_point);
        const std::vector<Expr> first = back;
        for (std::size_t axis = 0; axis < fields.size(); ++axis)
          back[axis] = (first[axis] + taken(fields[axis], first, Along::cubic)) / 2.0;
        back = shared_way("mean", back, at_point);
      }
      value = taken(name_in(mid, state.name), back, Along::cubic);
    }
    kernel.stores.push_back({into[i], false, value, state.origin});
  }
  stages.push_back(ways.stage());
  stages.push_back(Lowering::stage(std::move(kernel), at_point, reading.time));
  return stages;
}

/// The step backwards and the correction by half of what it leaves.
Stage correction(const Lowering& lowering, const Fields& mid, const Fields& ahead,
                 const std::vector<std::string>& into) {
  const model::Problem& problem = lowering.problem();
  Discretiser at_point = lowering.discretiser();
  std::vector<std::vector<Expr>> back;
  for (const model::State& state : problem.states) {
    const model::Advect* transport = find_transport(state);
    back.push_back(transport ? shared_way("back", way(*transport, true, at_point), at_point) : std::vector<Expr>{});
  }
  Reading reading;
  reading.fields = ahead;
  reading.time = param("t") + param("dt");
  at_point.read(reading);
  Kernel kernel = lowering.kernel(problem.scene + "_correct");
  for (std::size_t i = 0; i < into.size(); ++i) {
    const model::State& state = problem.states[i];
    const std::string field = name_in(mid, state.name), predicted = name_in(ahead, state.name);
    Expr value = access(field);
    if (const model::Advect* transport = find_transport(state)) {
      const std::vector<Expr> forth = shared_way("forth", way(*transport, false, at_point), at_point);
      const Expr error = (value - taken(predicted, forth, Along::linear)) / 2.0;
      const Expr corrected = access(predicted) + within_walls(error, problem.axes, back[i], forth);
      const Bounds bounds = bounds_at(field, back[i], at_point);
      value = call(Fn::min, {bounds.greatest, call(Fn::max, {corrected, bounds.least})});
    }
    kernel.stores.push_back({into[i], false, value, state.origin});
  }
  return Lowering::stage(std::move(kernel), at_point, reading.time);
}

}  // namespace

void check_semi_lagrangian(const model::Problem& problem, DiagnosticSink& sink) {
  const std::size_t before = sink.all().size();
  for (const model::State& state : problem.states) {
    if (state.rhs) check_state(state, sink);
  }
  if (problem.scheme.advect != model::Advection::maccormack || sink.all().size() > before) return;
  for (const model::State& state : problem.states) {
    if (state.rhs) check_velocity(problem, state, sink);
  }
}

std::vector<Stage> semi_lagrangian_stages(Lowering& lowering, const std::vector<std::string>& into) {
  Fields mid, ahead;
  std::vector<Stage> stages = stages_of_terms(lowering, mid);
  const model::Problem& problem = lowering.problem();
  if (problem.scheme.advect == model::Advection::semi_lagrangian) {
    const bool is_traced =
        interpolation(problem) == Along::cubic && std::ranges::any_of(problem.states, [](const model::State& state) {
          const model::Advect* transport = find_transport(state);
          return transport && !is_constant(*transport);
        });
    const std::vector<Stage> traced =
        is_traced ? traced_stages(lowering, mid, into) : std::vector{semi_lagrangian_stage(lowering, mid, into)};
    stages.insert(stages.end(), traced.begin(), traced.end());
  } else {
    Stage first = prediction(lowering, mid, ahead);
    if (!first.kernel.stores.empty()) stages.push_back(std::move(first));
    stages.push_back(correction(lowering, mid, ahead, into));
  }
  return stages;
}

}  // namespace dpde::stencil
