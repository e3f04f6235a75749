// SPDX-License-Identifier: Apache-2.0
// What a pole has to do with a limit of steps, and what helps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/boundary/metric.h"
#include "model/build.h"
#include "stability/stability_report.h"
#include "stability/state_groups.h"

namespace dpde::stability {

namespace {

/// Whether the expression reads neighbours along an axis.
bool reads_along(const model::Expr& e, int axis) {
  return any_part(e, [&](const model::Expr& part) {
    const auto* d = as<model::Derivative>(part);
    const auto* shift = as<model::Shift>(part);
    return (d != nullptr && d->axis == axis) ||
           (shift != nullptr && shift->offset[static_cast<std::size_t>(axis)] != 0);
  });
}

bool solves(const model::Expr& e) { return holds_any<model::Solve>(e); }

/// Whether the state is a scalar whose diffusion an implicit scheme can take.
bool spreads(const model::State& state) {
  const bool is_number = state.name.find('.') == std::string::npos && state.velocity_of.empty();
  return is_number && std::ranges::any_of(model::terms_of(*state.rhs), [](const model::Term& term) {
           return !solves(term.value) && model::nested_order(term.value) > 1;
         });
}

/// Terms in the equations of a group.
struct Rates {
  bool diffuse = false, are_filtered = false;  // along the axis around the pole alone

  Rates(const model::Problem& problem, const StabilityReport& verdict, int around) {
    for (const model::State& state : problem.states) {
      if (!state.rhs || !is_in(verdict.group, state.name)) continue;
      diffuse = diffuse || spreads(state);
      are_filtered = are_filtered || any_part(*state.rhs, [&](const model::Expr& part) {
                       const auto* solve = as<model::Solve>(part);
                       return solve != nullptr && reads_along(solve->operation, around) &&
                              !reads_along(solve->operation, 1 - around);
                     });
    }
  }
};

std::string remedy(const Rates& rates, const std::string& around) {
  std::string text = fmt::format("fewer cells along {} make them wider", around);
  if (rates.diffuse) text += ", and an implicit scheme (time = ars222) has no such limit for lap(u) of a number";
  if (!rates.are_filtered)
    text += fmt::format(
        ", and rates that are filtered along {} let {}steps be longer, as in "
        "dsl-examples/sphere/filtered.dpde",
        around, rates.diffuse ? "what waves and flows set of " : "");
  return text;
}

}  // namespace

std::string pole_text(const model::Problem& problem, const StabilityReport& verdict) {
  if (verdict.limit.kind != StepLimit::Kind::limit) return "";
  for (std::size_t a = 0; a < problem.axes.size(); ++a) {
    const model::Axis& axis = problem.axes[a];
    for (const bool is_low : {true, false}) {
      const double h = axis.spacing(), beside = is_low == axis.runs_down() ? axis.high - h / 2 : axis.low + h / 2;
      const bool is_there = std::abs(verdict.worst.place[a] - beside) < 0.5 * h;
      if (!is_there || !model::is_pole_at(problem, a, is_low)) continue;
      const std::size_t around = a == 0 ? 1 : 0;
      return fmt::format(
          "the narrow cells around the pole at {} set it: {}", model::name_of_side(problem, a, is_low),
          remedy(Rates(problem, verdict, static_cast<int>(around)), model::name_of_axis(problem, around)));
    }
  }
  return "";
}

}  // namespace dpde::stability
