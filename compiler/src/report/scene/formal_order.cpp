// SPDX-License-Identifier: Apache-2.0
#include "report/scene/formal_order.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "model/analyse/implicit_part.h"
#include "model/boundary/metric.h"
#include "model/boundary/wall_coefficient.h"
#include "model/build.h"
#include "model/uses.h"
#include "stencil/space/operator_order.h"
#include "stencil/space/waves.h"
#include "support/assert.h"

namespace dpde::report {

namespace {

bool is_transport_alone(const model::Expr& rate) {
  const model::Neg* neg = as<model::Neg>(rate);
  return neg && is<model::Advect>(neg->operand);
}

/// Limit of the order in time by multirate steps. 1 if a slow equation reads a faster one, frozen at the beginning of
/// the step; else 2, since the faster equations interpolate the slow ones linearly.
int order_with_parts(const model::Problem& problem, int order) {
  const auto parts_of = [&](const std::string& name) {
    const model::State* read = problem.find_state(name);
    return read == nullptr ? 1 : read->parts;
  };
  const bool has_parts = std::ranges::any_of(problem.states, [](const model::State& state) { return state.parts > 1; });
  for (const model::State& state : problem.states) {
    const bool reads_faster = state.rhs && any_part(*state.rhs, [&](const model::Expr& e) {
                                const model::Field* field = as<model::Field>(e);
                                return field != nullptr && parts_of(field->name) > state.parts;
                              });
    if (reads_faster) return 1;
  }
  return has_parts ? std::min(order, 2) : order;
}

constexpr int order_of_walls = 2;
constexpr int order_of_pressure_before = 2;  // for steps whose stages use the p of the previous step

/// Whether the field is a coefficient in the operand of a difference along the axis, i.e. read beyond walls. Fields
/// inside another difference are not.
bool is_coefficient_beside(const model::Expr& e, int axis, const std::string& name) {
  if (const model::Derivative* d = as<model::Derivative>(e); d != nullptr && d->axis == axis) return false;
  if (const model::Field* field = as<model::Field>(e)) return field->name == name;
  return any_child(e, [&](const model::Expr& child) { return is_coefficient_beside(child, axis, name); });
}

bool has_slope(const model::Problem& problem, std::size_t axis, bool is_low) {
  return std::ranges::any_of(problem.states, [&](const model::State& state) {
    if (axis >= state.boundary.size()) return false;
    const model::AxisSides& sides = state.boundary[axis];
    return condition_of((is_low ? sides.low : sides.high).kind).has_slope();
  });
}

/// "q is mirrored beyond x.low" for a coefficient that a difference along the axis reads there; "" if none. In a flux
/// this matters only with a slope condition: with value conditions, or without a flux, the error is of order 2.
std::string mirrored_in(const model::Problem& problem, const model::Expr& operand, int axis) {
  const bool is_flux = any_part(operand, [&](const model::Expr& e) {
    const model::Derivative* inner = as<model::Derivative>(e);
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

/// Whether the formula affects the accuracy of states: all formulas of steps. Observables and losses only read states,
/// and `speed` only sets the step.
bool moves_states(model::UseKind kind) {
  return model::time_of(kind) == model::UseTime::step && kind != model::UseKind::courant_rate;
}

/// Ghost values are accurate to order 2, mirrored coefficients to order 1.
void limit_at_walls(const model::Problem& problem, Order& order) {
  const auto is_bounded = [&](int axis) {
    return problem.axes[static_cast<std::size_t>(axis)].topology == Topology::bounded;
  };
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (!moves_states(use.kind)) return;
    any_part(use.formula, [&](const model::Expr& e) {
      const auto look = [&](const model::Expr& operand, int axis) {
        if (!is_bounded(axis)) return;
        order.space = std::min(order.space, order_of_walls);
        const std::string mirrored = mirrored_in(problem, operand, axis);
        if (mirrored.empty()) return;
        order.space = 1;
        order.walls = mirrored;
      };
      if (const model::Derivative* d = as<model::Derivative>(e)) look(d->operand, d->axis);
      if (const model::Advect* advect = as<model::Advect>(e)) {
        for (int axis = 0; axis < static_cast<int>(problem.axes.size()); ++axis) look(advect->operand, axis);
      }
      return false;
    });
  });
}

/// Whether an exponential time scheme treats the term exactly: derivatives of the state itself, in its own equation.
bool is_exact_part(const model::Scheme& scheme, const model::Expr& term, const std::string& state) {
  const stencil::WaveReading all{[](const model::Expr&) { return true; },
                                 [](const model::Expr&) { return stencil::Expr(1.0); }};
  if (!model::is_exponential(scheme.time) || !stencil::is_of_waves(term, all)) return false;
  const std::vector<stencil::WavePart> parts = stencil::wave_parts(term, all);
  return parts.size() == 1 && parts[0].operand == model::field(state);
}

bool holds_advect(const model::Expr& e) { return holds_any<model::Advect>(e); }

/// Order in time of fractional steps. `others`: some equation has terms other than transport.
int order_of_parts(const model::Problem& problem, bool others) {
  const model::Scheme& scheme = problem.scheme;
  const bool is_carried_to_first = std::ranges::any_of(problem.states, [&](const model::State& state) {
    const model::Transport& transport = scheme.transport_of(state.name);
    const bool is_linear = transport.advect == model::Advection::semi_lagrangian && transport.order == 1;
    return state.rhs && holds_advect(*state.rhs) &&
           (is_linear || transport.advect == model::Advection::maccormack_steady);
  });
  if (is_carried_to_first || !problem.projections.empty()) return 1;
  if (scheme.is_split()) return scheme.split.kind == model::Split::Kind::lie ? 1 : std::min(2, scheme.time->order);
  return others ? 1 : 2;
}

/// The formal order away from walls: the lowest order used in equations. For operators of the file, the stated order.
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
      if (is<model::Advect>(e)) {
        add(model::transport_of(scheme, std::get<model::Advect>(e->kind)).order);
        transports = transports || is_rate;
        split = split || (is_rate && !is_transport_alone(use.formula));
      }
      if (const model::Derivative* d = as<model::Derivative>(e)) {
        add(d->order % 2 == 0 ? scheme.laplacian_order : scheme.derivative_order);
      }
      return false;
    };
    for (const model::Term& term : model::terms_of(use.formula)) {
      const bool is_exact = is_rate && is_exact_part(scheme, term.value, use.owner);
      uses_waves = uses_waves || is_exact;
      if (!is_exact) any_part(term.value, look);
    }
  });
  for (const model::StatedOrder& stated : problem.operators) {
    if (stated.in_equations) space.push_back(stated.order);
  }
  Order order;
  order.space = space.empty() ? 0 : *std::min_element(space.begin(), space.end());
  order.is_spectral = space.empty() && uses_waves;
  order.time = order_with_parts(problem, scheme.time->order);
  if (scheme.is_split() || (scheme.is_semi_lagrangian() && transports)) order.time = order_of_parts(problem, split);
  if (std::ranges::any_of(problem.projections, &model::Projection::is_each_step))
    order.time = std::min(order.time, order_of_pressure_before);
  return order;
}

/// The orders of the file's operators, without duplicates.
std::vector<OperatorOrder> orders_of_operators(const model::Problem& problem) {
  std::vector<OperatorOrder> all;
  for (const model::StatedOrder& stated : problem.operators) {
    const stencil::MeasuredOrder found = stencil::measure_order(problem, stated);
    OperatorOrder order{stated.name, stated.order};
    switch (found.kind) {
      case stencil::MeasuredOrder::Kind::found:
        order.measured = found.order;
        order.words = found.order == stated.order ? " and measured" : fmt::format(", measured {}", found.order);
        break;
      case stencil::MeasuredOrder::Kind::none:
        order.words = fmt::format(", but it grows as 1/h^{}", found.order);
        break;
      case stencil::MeasuredOrder::Kind::exact: order.words = ", exact for smooth fields"; break;
      case stencil::MeasuredOrder::Kind::unknown: order.words = fmt::format(", not measured: {}", found.why); break;
    }
    if (std::ranges::find(all, order) == all.end()) all.push_back(std::move(order));
  }
  return all;
}

std::string space_in_words(const Order& order) { return order.is_spectral ? "spectral" : std::to_string(order.space); }

}  // namespace

FormalOrder formal_order(const model::Problem& problem, const std::vector<driver::Jump>& jumps) {
  FormalOrder order;
  if (!problem.program.empty()) return order;
  order.is_known = true;
  order.inside = order_inside(problem);
  if (model::is_implicit(problem.scheme.time) && model::holds_at_states(problem))
    order.inside.time = std::min(order.inside.time, 1);
  order.smooth = order.inside;
  limit_at_walls(problem, order.smooth);
  order.whole = order.smooth;
  for (const driver::Jump& jump : jumps) order.jumps.push_back(jump.name);
  if (!jumps.empty()) {
    order.whole.space = order.smooth.is_spectral ? 1 : std::min(order.smooth.space, 1);
    order.whole.is_spectral = false;
  }
  order.is_by_tolerance = problem.substeps.control.has_value();
  order.operators = orders_of_operators(problem);
  return order;
}

Json json_of(const FormalOrder& order) {
  Json result = {{"order", {{"space", nullptr}, {"time", nullptr}}}};
  if (!order.is_known) return result;
  const auto space_json = [](const Order& of) { return of.is_spectral ? Json("inf") : Json(of.space); };
  result["order"] = {{"space", space_json(order.whole)},
                     {"time", order.whole.time},
                     {"space_inside", space_json(order.inside)},
                     {"walls", order.whole.walls.empty() ? Json(nullptr) : Json(order.whole.walls)},
                     {"jumps", order.jumps},
                     {"steps", order.is_by_tolerance ? "tolerance" : "equal"}};
  Json rows = Json::array();
  for (const OperatorOrder& each : order.operators) {
    rows.push_back({{"name", each.name},
                    {"stated", each.stated},
                    {"measured", each.measured ? Json(*each.measured) : Json(nullptr)},
                    {"note", each.measured ? Json(nullptr) : Json(each.words.substr(2))}});
  }
  result["operators"] = std::move(rows);
  return result;
}

std::string text_of(const FormalOrder& order) {
  if (!order.is_known) return "";
  const Order &inside = order.inside, &smooth = order.smooth, &whole = order.whole;
  std::string text = "order: ";
  if (whole.is_spectral || whole.space != 0 || inside.space != 0) {  // else there are no derivatives
    text += space_in_words(whole) + " in space";
    if (smooth.space != inside.space) text += fmt::format(" ({} away from walls)", inside.space);
    if (whole.space != smooth.space)
      text += fmt::format(" where {} jumps, {} elsewhere", fmt::join(order.jumps, ", "), space_in_words(smooth));
    text += ", ";
  }
  text += fmt::format(
      "{} in time{}{}\n", whole.time,
      order.is_by_tolerance ? " for equal steps (here the tolerance chooses them, and errors follow it)" : "",
      whole.walls.empty() ? "" : "; " + whole.walls);
  return text;
}

std::string text_of_operators(const FormalOrder& order) {
  std::string text;
  for (const OperatorOrder& each : order.operators)
    text += fmt::format("operator {}: order {} as stated{}\n", each.name, each.stated, each.words);
  return text;
}

void warn_of_jumps(const std::vector<driver::Jump>& jumps, DiagnosticSink& sink) {
  for (const driver::Jump& jump : jumps) {
    if (!jump.inside.empty()) {
      sink.report(
          "jump-in-coefficient", jump.range,
          {jump.name, "it jumps inside a cell, and the harmonic mean takes cells as wholes"},
          fmt::format("it jumps {}: let a face lie there, by other cells or by another end of the axis", jump.inside));
      continue;
    }
    sink.report(
        "jump-in-coefficient", jump.range, {jump.name, "at a face differences take the mean of both sides"},
        fmt::format("grad(u)/interpolate(1/{0}) in place of {0}*grad(u) has the harmonic mean there, and "
                    "order 2 where {0} jumps on faces between cells, 1 where inside of them{1}",
                    jump.is_factor ? jump.name : "k", jump.is_factor ? "" : ": k is all that multiplies grad(u)"));
  }
}

}  // namespace dpde::report
