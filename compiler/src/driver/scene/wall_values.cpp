// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/wall_values.h"

#include <fmt/format.h>

#include <functional>
#include <set>
#include <tuple>

#include "model/boundary/metric.h"
#include "model/boundary/wall_coefficient.h"
#include "model/build.h"
#include "stencil/walk.h"

namespace dpde::driver {

namespace {

struct Wall {
  std::size_t axis;
  bool is_low;
};
using Look = std::function<void(const model::Coefficient&, const Wall&)>;

/// Reports the first cell whose extrapolation has another sign on the wall. x fastest; control fields state after
/// state.
void look_at(const Session& session, const model::Coefficient& coefficient, const std::vector<double>& values,
             const Wall& wall, DiagnosticSink& sink) {
  const std::vector<model::Axis>& axes = session.axes();
  std::size_t stride = 1;
  for (std::size_t a = 0; a < wall.axis; ++a) stride *= static_cast<std::size_t>(axes[a].cells);
  const auto n = static_cast<std::size_t>(axes[wall.axis].cells);
  if (n < 2) return;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i / stride % n != (wall.is_low ? 0 : n - 1)) continue;
    const double beside = values[i], behind = values[wall.is_low ? i + stride : i - stride];
    const double on_wall = 1.5 * beside - 0.5 * behind;
    if (!(beside * on_wall < 0)) continue;
    sink.report(
        "sign-at-wall", coefficient.value.origin.range,
        {coefficient.name, fmt::format("{:.4g}", on_wall),
         model::name_of_side(session.problem(), wall.axis, wall.is_low), fmt::format("{:.4g}", beside)},
        "more cells, a smoother coefficient, or its formula in the equation, which is taken on the wall itself");
    return;
  }
}

/// Visits all coefficients that the step's fills extrapolate beyond a wall.
void for_each_led_beyond(const Compiled& compiled, const Look& look) {
  const stencil::Program* step = compiled.stencil.find_program(compiled.step_name());
  if (step == nullptr) return;
  for_each_kind<stencil::Fill>(step->body, [&](const stencil::Fill& fill) {
    const model::Coefficient* coefficient = compiled.problem->find_coefficient(fill.field);
    for (std::size_t axis = 0; coefficient != nullptr && axis < fill.axes.size(); ++axis) {
      if (fill.axes[axis].topology == Topology::periodic) continue;
      if (fill.axes[axis].low.kind == SideKind::linear) look(*coefficient, {axis, true});
      if (fill.axes[axis].high.kind == SideKind::linear) look(*coefficient, {axis, false});
    }
  });
}

/// Visits the coefficients whose wall value appears in the boundary value or slope of a state.
void for_each_led_to(const model::Problem& problem, const Look& look) {
  const auto look_at_side = [&](const model::Side& side, const Wall& wall) {
    if (condition_of(side.kind).takes_rate()) return;
    for (const model::Coefficient& coefficient : problem.coefficients) {
      if (model::reads(side.value, coefficient.name) && model::is_led_to_walls(problem, coefficient, wall.axis))
        look(coefficient, wall);
    }
  };
  for (const model::State& state : problem.states) {
    for (std::size_t axis = 0; axis < state.boundary.size(); ++axis) {
      if (problem.axes[axis].topology == Topology::periodic) continue;
      look_at_side(state.boundary[axis].low, {axis, true});
      look_at_side(state.boundary[axis].high, {axis, false});
    }
  }
}

}  // namespace

void warn_of_wall_values(Session& session, DiagnosticSink& sink) {
  const Compiled& compiled = session.compiled();
  if (!compiled.problem->program.empty()) return;
  std::set<std::tuple<std::string, std::size_t, bool>> told;
  const Look look = [&](const model::Coefficient& coefficient, const Wall& wall) {
    if (told.insert({coefficient.name, wall.axis, wall.is_low}).second)
      look_at(session, coefficient, session.workspace().dense(coefficient.name), wall, sink);
  };
  for_each_led_beyond(compiled, look);
  for_each_led_to(*compiled.problem, look);
}

}  // namespace dpde::driver
