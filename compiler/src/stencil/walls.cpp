// SPDX-License-Identifier: Apache-2.0
#include "stencil/walls.h"

#include <algorithm>
#include <optional>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/discretise.h"

namespace dpde::stencil {

namespace {

Expr lowered(const model::Expr& value, const Expr& time) {
  Reading reading;
  reading.time = time;
  return Discretiser(model::Scheme{}, NameSupply(), reading)(value);
}

/// `e` with the coordinate along the axis replaced by that of the wall.
Expr at_wall(const Expr& e, const std::string& coordinate, double wall) {
  const Access* read = std::get_if<Access>(&e->kind);
  if (read && read->field == coordinate) return wall;
  return map_children(e, [&](const Expr& part) { return at_wall(part, coordinate, wall); });
}

}  // namespace

bool Walls::varies(const model::Expr& value) const {
  return model::any_part(value, [&](const model::Expr& part) {
    const auto* param = std::get_if<model::Param>(&part->kind);
    const model::Parameter* known = param ? problem_.find_param(param->name) : nullptr;
    return std::holds_alternative<model::Coordinate>(part->kind) || (known && known->unknown);
  });
}

std::vector<AxisBoundary> Walls::boundary(const model::State& state, const Expr& time, Module& module,
                                          Program& program) {
  std::vector<AxisBoundary> boundary;
  std::vector<std::pair<int, bool>> varying;  // sides, as axis and whether it is the low one
  std::optional<Expr> value;                  // at each halo cell that of the axis filled last
  for (int axis = 0; axis < static_cast<int>(problem_.axes.size()); ++axis) {
    boundary.push_back({problem_.axes[axis].topology, {}, {}});
    if (boundary.back().topology == Topology::periodic) continue;
    for (const bool is_low : {true, false}) {
      const model::Side& from = is_low ? state.boundary[axis].low : state.boundary[axis].high;
      const double wall = is_low ? problem_.axes[axis].low : problem_.axes[axis].high;
      const Expr c = at_wall(lowered(from.value, time), axis_letter(axis), wall);
      Side& side = is_low ? boundary.back().low : boundary.back().high;
      side = {from.kind, c, lowered(from.a, time), lowered(from.b, time)};
      if (from.kind == SideKind::zero_gradient || !varies(from.value)) continue;
      const Expr beyond = binary(is_low ? BinaryOp::less : BinaryOp::greater, access(axis_letter(axis)), wall);
      value = value ? select(beyond, c, *value) : c;
      varying.emplace_back(axis, is_low);
    }
  }
  if (!value) return boundary;
  const std::string field = stored(state.name, *value, module, program);
  for (const auto& [axis, is_low] : varying) (is_low ? boundary[axis].low : boundary[axis].high).value = access(field);
  return boundary;
}

/// The field that holds `value` on the halo, stored once where several fills need the same.
std::string Walls::stored(const std::string& state, const Expr& value, Module& module, Program& program) {
  const auto same = [&](const auto& known) { return known.first == value; };
  const auto found = std::find_if(stored_.begin(), stored_.end(), same);
  if (found != stored_.end()) return found->second;
  const std::string field = names_.fresh(state + "_wall");
  Kernel kernel;
  kernel.name = program.name + "_" + field;
  kernel.rank = static_cast<int>(problem_.axes.size());
  kernel.stores.push_back({field, false, value, {}});
  program.body.push_back(Run{kernel.name, width_});
  module.kernels.push_back(std::move(kernel));
  stored_.emplace_back(value, field);
  return field;
}

}  // namespace dpde::stencil
