// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/projections.h"

#include <algorithm>

#include "stencil/build.h"

namespace dpde::stencil {

FieldsOfStates before_projection(Lowering& lowering, const FieldsOfStates& into, bool is_last) {
  FieldsOfStates fields = into;
  for (const model::Projection& projection : lowering.problem().projections) {
    if (!projection.follows(is_last)) continue;
    fields.erase(projection.multiplier);
    for (const model::Event::Update& update : projection.updates)
      fields[update.state] = lowering.field_beside(update.state, "star");
  }
  return fields;
}

std::vector<Stage> projection_stages(Lowering& lowering, const ProjectedStage& stage) {
  std::vector<Stage> stages;
  for (const model::Projection& projection : lowering.problem().projections) {
    const auto is_stored = [&](const auto& update) { return stage.into.contains(update.state); };
    if (!projection.follows(stage.is_last) || !std::ranges::all_of(projection.updates, is_stored)) continue;
    Environment reading;
    reading.fields = stage.from;
    reading.time = stage.time;
    Discretiser at_point = lowering.discretiser(reading);
    const std::string what = projection.potential ? projection.multiplier : "held";
    Kernel kernel = lowering.kernel(stage.name + "_" + what);
    for (const model::Event::Update& update : projection.updates) {
      const Expr value = at_point(update.value, lowering.placement_of(update.state));
      kernel.stores.push_back({stage.into.at(update.state), false, value, projection.origin});
    }
    const auto kept = stage.into.find(projection.multiplier);
    if (projection.potential && kept != stage.into.end()) {
      const Expr found = at_point(*projection.potential) / (projection.is_each_step() ? stage.step : stage.length);
      const Expr value = projection.is_increment() ? access(projection.multiplier) + found : found;
      kernel.stores.push_back({kept->second, false, value, projection.origin});
    }
    stages.push_back(Lowering::stage(std::move(kernel), at_point, stage.time));
  }
  return stages;
}

}  // namespace dpde::stencil
