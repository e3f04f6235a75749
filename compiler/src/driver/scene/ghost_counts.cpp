// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/ghost_counts.h"

#include <algorithm>

#include "stencil/build.h"
#include "stencil/walk.h"

namespace dpde::driver {

namespace {

/// The state of a fill: its field, or the one of which a stage computes that field.
const model::State* state_of(const model::Problem& problem, const stencil::Fill& fill) {
  return problem.find_state(fill.written.field.empty() ? fill.field : fill.written.field);
}

bool is_mixed(const stencil::AxisBoundary& axis) {
  return axis.topology == Topology::bounded && (axis.low.kind == SideKind::mixed || axis.high.kind == SideKind::mixed);
}

}  // namespace

model::GhostCounts ghost_counts(const Compiled& compiled) {
  model::GhostCounts counts;
  if (!compiled.problem) return counts;
  for (const std::string& name : compiled.primal_programs) {
    const stencil::Program& program = *compiled.stencil.find_program(name);
    const auto halos = stencil::required_halo(compiled.stencil, program);
    for_each_kind<stencil::Fill>(program.body, [&](const stencil::Fill& fill) {
      const model::State* state = state_of(*compiled.problem, fill);
      if (state == nullptr || std::ranges::none_of(fill.axes, is_mixed)) return;
      std::vector<int>& of_state = counts[state->name];
      of_state.resize(fill.axes.size());
      for (std::size_t axis = 0; axis < fill.axes.size(); ++axis)
        of_state[axis] = std::max(of_state[axis], halos.at(fill.field)[axis]);
    });
  }
  return counts;
}

void check_ghosts(const Compiled& compiled, DiagnosticSink& sink) {
  if (!compiled.problem) return;
  model::KnownValues values;
  for (const model::Parameter& parameter : compiled.problem->params) values[parameter.name] = parameter.value;
  const auto misfit = model::misfit_of_walls(*compiled.problem, values, ghost_counts(compiled), model::Walls::all);
  if (misfit) report(misfit->misfit, "", misfit->range, sink);
}

}  // namespace dpde::driver
