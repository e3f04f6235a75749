// SPDX-License-Identifier: Apache-2.0
#include "driver/wall_values.h"

#include <fmt/format.h>

#include <set>

#include "stencil/effects.h"

namespace dpde::driver {

namespace {

struct Wall {
  std::size_t axis;
  bool is_low;
};

/// Of the first cell whose line has another sign on the wall; x fastest, several states of a control field one after
/// the other.
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
        {coefficient.name, fmt::format("{:.4g}", on_wall), model::side_name(axes[wall.axis], wall.is_low),
         fmt::format("{:.4g}", beside)},
        "more cells, a smoother coefficient, or its formula in the equation, which is taken on the wall itself");
    return;
  }
}

}  // namespace

void warn_of_wall_values(Session& session, DiagnosticSink& sink) {
  const Compiled& compiled = session.compiled();
  const stencil::Program* step = compiled.stencil.find_program(compiled.step_name());
  if (step == nullptr || !compiled.problem->program.empty()) return;
  std::set<std::string> told;
  stencil::for_each_fill(*step, [&](const stencil::Fill& fill) {
    const model::Coefficient* coefficient = compiled.problem->find_coefficient(fill.field);
    if (coefficient == nullptr || !told.insert(fill.field).second) return;
    for (std::size_t axis = 0; axis < fill.axes.size(); ++axis) {
      if (fill.axes[axis].topology == Topology::periodic) continue;
      for (const bool is_low : {true, false}) {
        const stencil::Side& side = is_low ? fill.axes[axis].low : fill.axes[axis].high;
        if (side.kind == SideKind::linear)
          look_at(session, *coefficient, session.workspace().dense(fill.field), {axis, is_low}, sink);
      }
    }
  });
}

}  // namespace dpde::driver
