// SPDX-License-Identifier: Apache-2.0
// Sides of bounded axes: their expressions, and their rules for fills, folds and derivatives.
#include <algorithm>
#include <set>
#include <string>

#include "stencil/build.h"

namespace dpde::stencil {

std::array<SideCoefficient, side_coefficients> coefficients_of(const Side& side) {
  const SideCondition& condition = condition_of(side.kind);
  const auto part = [](SideCondition::Part from, const Expr& given) {
    return from == SideCondition::Part::given ? given : Expr(from == SideCondition::Part::one ? 1.0 : 0.0);
  };
  return {{{part(condition.a, side.a)}, {part(condition.b, side.b), condition.has_spacing()}}};
}

const GhostRule& rule_of(const Side& side) { return condition_of(side.kind).rule(side.on_wall); }

bool derives_wall(const Side& side, int cells) {
  const GhostRow& row = rule_of(side).wall.on(cells);
  const auto coefficients = coefficients_of(side);
  for (int t = 0; t < side_coefficients; ++t) {
    const GhostRow::Term& term = row.terms[t];
    const bool reads = term.mirror != GhostNumber{} || term.second != GhostNumber{};
    if (reads && !is_literal(coefficients[t].value, 0)) return true;
  }
  return false;
}

const std::string* wall_field(const Side& side) {
  const Access* access = as<Access>(side.value);
  return access ? &access->field : nullptr;
}

bool is_on_walls(const AxisBoundary& axis) { return axis.topology == Topology::bounded && axis.low.on_wall; }

bool is_on_walls(const std::vector<AxisBoundary>& axes) {
  return std::any_of(axes.begin(), axes.end(), [](const AxisBoundary& axis) { return is_on_walls(axis); });
}

std::set<std::string> wall_fields(const std::vector<AxisBoundary>& axes) {
  std::set<std::string> fields;
  for_each_side(axes, [&](const Side& side) {
    if (const std::string* wall = wall_field(side)) fields.insert(*wall);
  });
  return fields;
}

void for_each_side(const std::vector<AxisBoundary>& axes, const std::function<void(const Side&)>& f) {
  for (const AxisBoundary& axis : axes) {
    if (axis.topology == Topology::periodic) continue;
    f(axis.low);
    f(axis.high);
  }
}

void for_each_side_value(const std::vector<AxisBoundary>& axes, const std::function<void(const Expr&)>& f) {
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis].topology == Topology::periodic) continue;
    for (const Side* side : {&axes[axis].low, &axes[axis].high}) {
      f(side->value);
      const auto coefficients = coefficients_of(*side);
      for (const SideCoefficient& c : coefficients) f(c.value);
      const bool has_spacing = std::ranges::any_of(coefficients, &SideCoefficient::per_spacing);
      if (has_spacing) f(param(std::string("h") + "xyz"[axis]));
    }
  }
}

std::vector<AxisBoundary> map_sides(std::vector<AxisBoundary> axes, const std::function<Expr(const Expr&)>& f) {
  for (AxisBoundary& axis : axes) {
    for (Side* side : {&axis.low, &axis.high}) {
      for (Expr* part : {&side->value, &side->a, &side->b}) *part = f(*part);
    }
  }
  return axes;
}

}  // namespace dpde::stencil
