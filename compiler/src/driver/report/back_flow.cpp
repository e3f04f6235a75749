// SPDX-License-Identifier: Apache-2.0
#include "driver/report/back_flow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/boundary/metric.h"
#include "support/side_conditions.h"

namespace dpde::driver {

namespace {

constexpr double least_share = 1e-3;  // of the largest speed

bool is_open_end(const model::Problem& problem, const model::State& state, std::size_t axis) {
  return problem.axes[axis].topology == Topology::bounded && state.placement[axis] &&
         condition_of(state.boundary[axis].high.kind).keeps_wall() && problem.is_projected(state.name);
}

}  // namespace

void BackFlowWatch::look(double t, const std::vector<void*>& states) {
  const model::Problem& problem = session_->problem();
  for (const model::State& state : problem.states) {
    const int index = session_->rollout().state_index(state.name);
    for (std::size_t axis = 0; index >= 0 && axis < problem.axes.size(); ++axis) {
      if (is_open_end(problem, state, axis)) look_at(state, axis, t, states[static_cast<std::size_t>(index)]);
    }
  }
}

void BackFlowWatch::look_at(const model::State& state, std::size_t axis, double t, const void* values) {
  const dpde_layout& layout = session_->workspace().layout();
  const model::Axis& along = session_->problem().axes[axis];
  Worst now{.t = t};
  const auto look = [&](const auto* numbers) {
    for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
      for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
        for (std::int64_t x = 0; x < layout.cells[0]; ++x) {
          const auto value = static_cast<double>(numbers[index_of(layout, x, y, z)]);
          now.largest = std::max(now.largest, std::abs(value));
          const std::int64_t place[3] = {x, y, z};
          if (place[axis] + 1 != layout.cells[axis]) continue;
          ++now.of;
          const double outwards = along.runs_down() ? -value : value;
          now.faces += outwards < 0 ? 1 : 0;
          now.inwards = std::max(now.inwards, -outwards);
        }
      }
    }
  };
  layout.real == DPDE_F32 ? look(static_cast<const float*>(values)) : look(static_cast<const double*>(values));
  Worst& worst = worst_[{state.name, axis}];
  if (now.share() > worst.share()) worst = now;
}

void BackFlowWatch::report(DiagnosticSink& sink) const {
  const model::Problem& problem = session_->problem();
  for (const auto& [side, worst] : worst_) {
    if (!(worst.share() > least_share)) continue;
    const auto& [name, axis] = side;
    sink.report(
        "back-flow", problem.find_state(name)->origin.range,
        {name_of_side(problem, axis, false), fmt::format("{:.6g}", worst.t), fmt::format("{:.3g}", worst.inwards),
         fmt::format("{}", worst.faces), fmt::format("{}", worst.of), fmt::format("{:.3g}", worst.largest)},
        "the values that it brings in are not known, so that they may be wrong and grow: put the open end farther "
        "away");
  }
}

}  // namespace dpde::driver
