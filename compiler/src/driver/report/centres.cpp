// SPDX-License-Identifier: Apache-2.0
#include "driver/report/centres.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "driver/report/run_description.h"

namespace dpde::driver {

namespace {

/// Wall value on the low side of the axis; nullopt if the array contains it or there is none.
std::optional<double> wall_value(const model::Problem& problem, const std::string& field, std::size_t axis) {
  const model::State* state = problem.find_state(field);
  if (state == nullptr || axis >= state->boundary.size()) return std::nullopt;
  const model::Side& side = state->boundary[axis].low;
  const auto* number = as<model::Number>(side.value);
  return side.kind == SideKind::value && number != nullptr ? std::optional(number->value) : std::nullopt;
}

/// For values `stride` apart: replaces each by the mean of itself and the one before.
void average(double* line, int cells, std::size_t stride, double before) {
  for (int i = 0; i < cells; ++i) {
    double& value = line[static_cast<std::size_t>(i) * stride];
    const double face = value;
    value = 0.5 * (before + face);
    before = face;
  }
}

double before_first(const double* line, const model::Axis& axis, std::size_t stride, std::optional<double> wall) {
  if (axis.topology == Topology::periodic) return line[static_cast<std::size_t>(axis.cells - 1) * stride];
  if (wall) return *wall;
  return axis.cells > 1 ? 2 * line[0] - line[stride] : line[0];
}

}  // namespace

std::vector<double> at_centres(const model::Problem& problem, const std::vector<model::Axis>& axes,
                               const std::string& field, std::vector<double> values) {
  const model::Placement placement = placement_of(problem, field);
  std::size_t stride = 1;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const model::Axis& axis = axes[a];
    const std::size_t length = stride * static_cast<std::size_t>(axis.cells);
    const std::optional<double> wall = wall_value(problem, field, a);
    for (std::size_t block = 0; placement[a] && block + length <= values.size(); block += length) {
      for (std::size_t i = 0; i < stride; ++i) {
        double* line = values.data() + block + i;
        average(line, axis.cells, stride, before_first(line, axis, stride, wall));
      }
    }
    stride = length;
  }
  return values;
}

void add_centres(RunDescription& run, const model::Problem& problem, const std::vector<model::Axis>& axes) {
  for (RunField& field : run.fields) {
    if (std::ranges::find(field.on_faces, true) == field.on_faces.end()) continue;
    field.at_centres = [&problem, &axes, name = field.name](std::vector<double> values) {
      return at_centres(problem, axes, name, std::move(values));
    };
  }
}

}  // namespace dpde::driver
