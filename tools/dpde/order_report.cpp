// SPDX-License-Identifier: Apache-2.0
#include "order_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "model/build.h"
#include "model/implicit_part.h"
#include "model/metric.h"
#include "model/uses.h"
#include "model/wall_coefficient.h"
#include "stencil/operator_order.h"
#include "stencil/waves.h"
#include "support/assert.h"

namespace dpde::tools {

namespace {

struct Order {
  int space = 0, time = 0;
  bool is_spectral = false;  // in space: all derivatives are Fourier series
  std::string walls = "";    // what makes it lower there than differences of values beyond them do
};

bool is_transport_alone(const model::Expr& rate) {
  const model::Neg* neg = std::get_if<model::Neg>(&rate->kind);
  return neg && std::holds_alternative<model::Advect>(neg->operand->kind);
}

/// What is left of the order in time by equations with steps of their own: 1 where a slow one reads a faster one, which
/// it sees where the step begins, else 2: the faster ones see the slow on straight lines.
int order_with_parts(const model::Problem& problem, int order) {
  const auto parts_of = [&](const std::string& name) {
    const model::State* read = problem.find_state(name);
    return read == nullptr ? 1 : read->parts;
  };
  const bool has_parts = std::ranges::any_of(problem.states, [](const model::State& state) { return state.parts > 1; });
  for (const model::State& state : problem.states) {
    const bool reads_faster = state.rhs && model::any_part(*state.rhs, [&](const model::Expr& e) {
                                const model::Field* field = std::get_if<model::Field>(&e->kind);
                                return field != nullptr && parts_of(field->name) > state.parts;
                              });
    if (reads_faster) return 1;
  }
  return has_parts ? std::min(order, 2) : order;
}

constexpr int order_of_walls = 2;
constexpr int order_of_pressure_before = 2;  // of steps whose stages have the p of the step before

/// What of an expression is taken beyond walls by a difference along the axis: all but what stands in another
/// difference.
bool is_coefficient_beside(const model::Expr& e, int axis, const std::string& name) {
  if (const model::Derivative* d = std::get_if<model::Derivative>(&e->kind); d != nullptr && d->axis == axis)
    return false;
  if (const model::Field* field = std::get_if<model::Field>(&e->kind)) return field->name == name;
  bool found = false;
  model::for_each_part(e, [&](const model::Expr& child) { found = found || is_coefficient_beside(child, axis, name); });
  return found;
}

bool has_slope(const model::Problem& problem, std::size_t axis, bool is_low) {
  return std::ranges::any_of(problem.states, [&](const model::State& state) {
    if (axis >= state.boundary.size()) return false;
    const model::AxisSides& sides = state.boundary[axis];
    return condition_of((is_low ? sides.low : sides.high).kind).has_slope();
  });
}

/// "q is mirrored beyond x.low" of a coefficient that a difference along the axis takes there; "" where none is. In a
/// flux it counts only where a slope is given: between values, and where nothing flows, its error is of order 2.
std::string mirrored_in(const model::Problem& problem, const model::Expr& operand, int axis) {
  const bool is_flux = model::any_part(operand, [&](const model::Expr& e) {
    const model::Derivative* inner = std::get_if<model::Derivative>(&e->kind);
    return inner != nullptr && inner->axis == axis;
  });
  const auto a = static_cast<std::size_t>(axis);
  for (const model::Coefficient& c : problem.coefficients) {
    if (c.walls || c.placement[a] || !is_coefficient_beside(operand, axis, c.name)) continue;
    for (const bool is_low : {true, false}) {
      const model::AtPoles& poles = c.at_poles[a];
      const bool is_at_pole = is_low == problem.axes[a].runs_down() ? poles.high : poles.low;
      if (is_at_pole || model::goes_on_beyond(problem, c, a, is_low) || (is_flux && !has_slope(problem, a, is_low)))
        continue;
      return fmt::format("{} is mirrored beyond {}", c.name, model::name_of_side(problem, a, is_low));
    }
  }
  return "";
}

/// What decides how near the states come to the solution: all that steps compute. Observables and losses are of states
/// that are there, and `speed` says how long steps are.
bool moves_states(model::UseKind kind) {
  return model::time_of(kind) == model::UseTime::step && kind != model::UseKind::courant_rate;
}

/// Values beyond walls are of order 2, coefficients that are mirrored there of order 1.
void limit_at_walls(const model::Problem& problem, Order& order) {
  const auto is_bounded = [&](int axis) {
    return problem.axes[static_cast<std::size_t>(axis)].topology == Topology::bounded;
  };
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (!moves_states(use.kind)) return;
    model::any_part(use.formula, [&](const model::Expr& e) {
      const auto look = [&](const model::Expr& operand, int axis) {
        if (!is_bounded(axis)) return;
        order.space = std::min(order.space, order_of_walls);
        const std::string mirrored = mirrored_in(problem, operand, axis);
        if (mirrored.empty()) return;
        order.space = 1;
        order.walls = mirrored;
      };
      if (const model::Derivative* d = std::get_if<model::Derivative>(&e->kind)) look(d->operand, d->axis);
      if (const model::Advect* advect = std::get_if<model::Advect>(&e->kind)) {
        for (int axis = 0; axis < static_cast<int>(problem.axes.size()); ++axis) look(advect->operand, axis);
      }
      return false;
    });
  });
}

/// What an exponential time scheme does without error.
bool is_exact_part(const model::Scheme& scheme, const model::Expr& term) {
  const stencil::WaveReading all{[](const model::Expr&) { return true; },
                                 [](const model::Expr&) { return stencil::Expr(1.0); }};
  return model::is_exponential(scheme.time) && stencil::is_of_waves(term, all);
}

bool holds_advect(const model::Expr& e) {
  return model::any_part(e, [](const model::Expr& part) { return std::holds_alternative<model::Advect>(part->kind); });
}

int time_order(model::TimeScheme time) {
  switch (time) {
    case model::TimeScheme::backward_euler:
    case model::TimeScheme::imex_euler:
    case model::TimeScheme::euler: return 1;
    case model::TimeScheme::crank_nicolson:
    case model::TimeScheme::ars222:
    case model::TimeScheme::verlet:
    case model::TimeScheme::ab2:
    case model::TimeScheme::leapfrog:
    case model::TimeScheme::etdrk2:
    case model::TimeScheme::rk2: return 2;
    case model::TimeScheme::etdrk4:
    case model::TimeScheme::rk4: return 4;
    case model::TimeScheme::ars443:
    case model::TimeScheme::ab3:
    case model::TimeScheme::bs32:
    case model::TimeScheme::ssp_rk3: return 3;
    case model::TimeScheme::dopri5: return 5;
  }
  unreachable("time scheme");
}

/// Of steps whose parts come one behind the other, in the order of time. `others`: some equation has more terms than
/// transport.
int order_of_parts(const model::Problem& problem, bool others) {
  const model::Scheme& scheme = problem.scheme;
  const bool is_carried_to_first = std::ranges::any_of(problem.states, [&](const model::State& state) {
    const model::Transport& transport = scheme.transport_of(state.name);
    const bool is_linear = transport.advect == model::Advection::semi_lagrangian && transport.order == 1;
    return state.rhs && holds_advect(*state.rhs) &&
           (is_linear || transport.advect == model::Advection::maccormack_steady);
  });
  if (is_carried_to_first || !problem.projections.empty()) return 1;
  if (scheme.is_split()) return scheme.split.kind == model::Split::Kind::lie ? 1 : std::min(2, time_order(scheme.time));
  return others ? 1 : 2;
}

/// The formal order of the scheme away from walls: the lowest of what the equations use; of operators of the file the
/// one that is stated.
Order order_inside(const model::Problem& problem) {
  const model::Scheme& scheme = problem.scheme;
  std::vector<int> space;
  bool uses_waves = false;
  const auto add = [&](int order) {
    if (order != model::spectral) space.push_back(order);
    uses_waves = uses_waves || order == model::spectral;
  };
  bool transports = false, split = false;
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (!moves_states(use.kind)) return;
    const bool is_rate = use.kind == model::UseKind::equation;
    const auto look = [&](const model::Expr& e) {
      if (std::holds_alternative<model::Advect>(e->kind)) {
        add(model::transport_of(scheme, std::get<model::Advect>(e->kind)).order);
        transports = transports || is_rate;
        split = split || (is_rate && !is_transport_alone(use.formula));
      }
      if (const model::Derivative* d = std::get_if<model::Derivative>(&e->kind)) {
        add(d->order % 2 == 0 ? scheme.laplacian_order : scheme.derivative_order);
      }
      return false;
    };
    for (const model::Term& term : model::terms_of(use.formula)) {
      const bool is_exact = is_rate && is_exact_part(scheme, term.value);
      uses_waves = uses_waves || is_exact;
      if (!is_exact) model::any_part(term.value, look);
    }
  });
  for (const model::StatedOrder& stated : problem.operators) {
    if (stated.in_equations) space.push_back(stated.order);
  }
  Order order;
  order.space = space.empty() ? 0 : *std::min_element(space.begin(), space.end());
  order.is_spectral = space.empty() && uses_waves;
  order.time = order_with_parts(problem, time_order(scheme.time));
  if (scheme.is_split() || (scheme.follows_flow() && transports)) order.time = order_of_parts(problem, split);
  if (std::ranges::any_of(problem.projections, &model::Projection::is_each_step))
    order.time = std::min(order.time, order_of_pressure_before);
  return order;
}

/// Operators of the file, with their orders as stated and as measured: null where there is no such number, and why.
std::string report_operators(const model::Problem& problem, Json& result) {
  std::string text;
  Json rows = Json::array();
  for (const model::StatedOrder& stated : problem.operators) {
    const stencil::MeasuredOrder found = stencil::measure_order(problem, stated);
    Json row = {{"name", stated.name}, {"stated", stated.order}, {"measured", nullptr}};
    std::string words;
    switch (found.kind) {
      case stencil::MeasuredOrder::Kind::found:
        row["measured"] = found.order;
        words = found.order == stated.order ? " and measured" : fmt::format(", measured {}", found.order);
        break;
      case stencil::MeasuredOrder::Kind::none: words = fmt::format(", but it grows as 1/h^{}", found.order); break;
      case stencil::MeasuredOrder::Kind::exact: words = ", exact for smooth fields"; break;
      case stencil::MeasuredOrder::Kind::unknown: words = fmt::format(", not measured: {}", found.why); break;
    }
    row["note"] = found.kind == stencil::MeasuredOrder::Kind::found ? Json(nullptr) : Json(words.substr(2));
    if (std::ranges::find(rows, row) != rows.end()) continue;
    text += fmt::format("operator {}: order {} as stated{}\n", stated.name, stated.order, words);
    rows.push_back(std::move(row));
  }
  result["operators"] = std::move(rows);
  return text;
}

std::string space_in_words(const Order& order) { return order.is_spectral ? "spectral" : std::to_string(order.space); }

}  // namespace

void warn_of_jumps(Job& job, const std::vector<driver::Jump>& jumps) {
  for (const driver::Jump& jump : jumps) {
    if (!jump.inside.empty()) {
      job.sink().report(
          "jump-in-coefficient", jump.range,
          {jump.name, "it jumps inside a cell, and the harmonic mean takes cells as wholes"},
          fmt::format("it jumps {}: let a face lie there, by other cells or by another end of the axis", jump.inside));
      continue;
    }
    job.sink().report(
        "jump-in-coefficient", jump.range, {jump.name, "at a face differences take the mean of both sides"},
        fmt::format("grad(u)/interpolate(1/{0}) in place of {0}*grad(u) has the harmonic mean there, and "
                    "order 2 where {0} jumps on faces between cells, 1 where inside of them{1}",
                    jump.is_factor ? jump.name : "k", jump.is_factor ? "" : ": k is all that multiplies grad(u)"));
  }
}

std::string report_order(const model::Problem& problem, Json& result, const std::vector<driver::Jump>& jumps) {
  result["order"] = {{"space", nullptr}, {"time", nullptr}};
  if (!problem.program.empty()) return "";
  Order inside = order_inside(problem);
  if (model::is_implicit(problem.scheme.time) && model::holds_at_states(problem))
    inside.time = std::min(inside.time, 1);
  Order order = inside;
  limit_at_walls(problem, order);
  result["order"] = {{"space", order.space},
                     {"time", order.time},
                     {"space_inside", inside.space},
                     {"walls", order.walls.empty() ? Json(nullptr) : Json(order.walls)}};
  if (inside.is_spectral) result["order"]["space"] = result["order"]["space_inside"] = "inf";
  std::vector<std::string> names;
  for (const driver::Jump& jump : jumps) names.push_back(jump.name);
  result["order"]["jumps"] = names;
  const Order smooth = order;
  if (!jumps.empty()) {
    order.space = order.is_spectral ? 1 : std::min(order.space, 1);
    order.is_spectral = false;
    result["order"]["space"] = order.space;
  }
  std::string text = "order: ";
  if (order.is_spectral || order.space != 0 || inside.space != 0) {  // else nothing is differentiated
    text += space_in_words(order) + " in space";
    if (smooth.space != inside.space) text += fmt::format(" ({} away from walls)", inside.space);
    if (order.space != smooth.space)
      text += fmt::format(" where {} jumps, {} elsewhere", fmt::join(names, ", "), space_in_words(smooth));
    text += ", ";
  }
  result["order"]["steps"] = problem.step_control ? "tolerance" : "equal";
  text += fmt::format(
      "{} in time{}{}\n", order.time,
      problem.step_control ? " for equal steps (here the tolerance chooses them, and errors follow it)" : "",
      order.walls.empty() ? "" : "; " + order.walls);
  return text + report_operators(problem, result);
}

}  // namespace dpde::tools
