// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/weights.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "support/assert.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

const Expr* find(const Slopes& slopes, const std::string& name) {
  const auto found = std::ranges::find_if(slopes, [&](const auto& slope) { return slope.first == name; });
  return found == slopes.end() ? nullptr : &found->second;
}

void set(Slopes& slopes, const std::string& name, const Expr& value) {
  const auto found = std::ranges::find_if(slopes, [&](const auto& slope) { return slope.first == name; });
  if (found == slopes.end()) {
    slopes.emplace_back(name, value);
  } else {
    found->second = value;
  }
}

void add(Slopes& slopes, const std::string& name, const Expr& value) {
  const Expr* const sum = find(slopes, name);
  set(slopes, name, sum == nullptr ? value : *sum + value);
}

/// Adds x * de/dp for each param p of `e`, which consists of params and numbers.
void add_slopes(const Expr& e, const Expr& x, const Varied& varied, Slopes& slopes) {
  if (!is_varied(e, varied)) return;
  if (const Param* p = as<Param>(e)) {
    add(slopes, p->name, x);
    return;
  }
  if (const Select* s = as<Select>(e)) {
    add_slopes(s->yes, select(s->condition, x, 0.0), varied, slopes);
    add_slopes(s->no, select(s->condition, 0.0, x), varied, slopes);
    return;
  }
  int index = 0;
  for_each_child(e, [&](const Expr& child) {
    if (is_varied(child, varied)) add_slopes(child, times_partial(e, index, x), varied, slopes);
    ++index;
  });
}

Offset along(int axis, int cells) {
  Offset offset{};
  offset[axis] = cells;
  return offset;
}

/// True if the point, in the region extended by `grow`, is at most `layer` cells beyond that side.
Expr is_within(const WallSide& at, int layer, int grow) {
  return inside(along(at.axis, at.is_low ? layer - grow : grow - layer), grow);
}

/// Derivatives of each coefficient of a side by the params.
using CoefficientSlopes = std::array<Slopes, side_coefficients>;

/// One layer of a side: its equation, and the position of its mirror cell relative to the layer.
struct Layer {
  const GhostRow& row;
  double way;
  int mirror;  // cells inwards
};

/// (ghost*v + mirror*u + second*w)/rate, also divided by the spacing if the coefficient is: the change of c that
/// compensates an increase of the coefficient by 1.
Expr share(const GhostRow::Term& term, const Layer& layer, bool per_spacing, const std::string& field,
           const WallSide& at) {
  const int inwards = at.is_low ? layer.mirror : -layer.mirror;
  const std::array<double, 3> numbers{term.ghost.at(layer.way), term.mirror.at(layer.way), term.second.at(layer.way)};
  const std::array<Expr, 3> values{access(field), access(field, along(at.axis, inwards)),
                                   access(field, along(at.axis, inwards + (at.is_low ? 1 : -1)))};
  double unit = std::abs(numbers[0]);  // the smallest of them
  for (const double number : numbers) {
    if (number != 0) unit = std::min(unit, std::abs(number));
  }
  std::optional<Expr> sum;
  std::array<std::size_t, 3> order{0, 1, 2};
  if (numbers[1] > 0) std::swap(order[0], order[1]);  // the sum starts with a positive term
  for (const std::size_t i : order) {
    if (numbers[i] == 0) continue;
    const double times = std::abs(numbers[i]) / unit;
    const Expr part = times * values[i];
    sum = !sum ? (numbers[i] < 0 ? -part : part) : numbers[i] < 0 ? *sum - part : *sum + part;
  }
  require(sum.has_value(), "a coefficient has a part in the row");
  const double rate = layer.row.rate.at(layer.way) / unit;
  if (per_spacing) return *sum / (rate * param(std::string("h") + "xyz"[at.axis]));
  return *sum / rate;
}

/// Derivatives of the layer's equation by the params.
Slopes combined(const CoefficientSlopes& slopes, const Side& side, const Layer& layer, const std::string& field,
                const WallSide& at) {
  Slopes here;
  const auto coefficients = coefficients_of(side);
  for (int t = 0; t < side_coefficients; ++t) {
    for (const auto& [name, slope] : slopes[t])
      add(here, name, slope * share(layer.row.terms[t], layer, coefficients[t].per_spacing, field, at));
  }
  return here;
}

/// The derivatives in layer k beyond the wall.
Slopes beyond_the_wall(const CoefficientSlopes& slopes, const Side& side, int k, const std::string& field,
                       const WallSide& at, int layers) {
  const GhostRows& rows = rule_of(side).beyond;
  require(rows.least <= 1, "a row with coefficients is the same on all axes");
  const GhostRow& row = rows.row;
  const Layer layer{row, static_cast<double>(2 * k + 1 - (side.on_wall ? 1 : 0)), row.first + row.step * k + 1 + k};
  Slopes here = combined(slopes, side, layer, field, at);
  // The mirror cell is never farther out than the ghost cell. The condition states this for extents_of.
  const Offset mirror = along(at.axis, at.is_low ? layer.mirror : -layer.mirror);
  for (auto& [name, value] : here) value = select(inside(mirror, layers), value, 0.0);
  return here;
}

/// The derivatives at a point on the wall. With fewer cells than its equation needs it has another one. With a single
/// cell the value on a high wall does not depend on values inside.
Slopes on_the_wall(const CoefficientSlopes& slopes, const Side& side, const std::string& field, const WallSide& at,
                   int layers) {
  const GhostRows& rows = rule_of(side).wall;
  const int inwards = at.is_low ? 1 : -1;
  const Offset near = along(at.axis, inwards), far = along(at.axis, 2 * inwards);
  const Slopes many = combined(slopes, side, {rows.row, 0, 1}, field, at),
               few = combined(slopes, side, {rows.of_few, 0, 1}, field, at);
  const auto has = [&](int cells) {
    return inside(along(at.axis, (cells - (at.is_low ? 0 : 1) + layers) * inwards), layers);
  };
  Slopes here;
  for (const auto& [name, value] : many) {
    const Expr any = select(inside(near, layers),
                            select(has(rows.least), select(inside(far, layers), value, 0.0), *find(few, name)), 0.0);
    add(here, name, at.is_low || !derives_wall(side, 1) ? any : select(has(2), any, 0.0));
  }
  return here;
}

}  // namespace

bool has_varied_weights(const Side& side, const Varied& varied) {
  return std::ranges::any_of(coefficients_of(side), [&](const auto& c) { return is_varied(c.value, varied); });
}

std::vector<WallSide> sides_with_varied_weights(const std::vector<AxisBoundary>& axes, const Varied& varied) {
  std::vector<WallSide> found;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis].topology == Topology::periodic) continue;
    for (const bool is_low : {true, false}) {
      const WallSide at{static_cast<int>(axis), is_low};
      if (has_varied_weights(side_at(axes, at), varied)) found.push_back(at);
    }
  }
  return found;
}

const Side& side_at(const std::vector<AxisBoundary>& axes, const WallSide& at) {
  const AxisBoundary& along = axes[static_cast<std::size_t>(at.axis)];
  return at.is_low ? along.low : along.high;
}

Side& side_at(std::vector<AxisBoundary>& axes, const WallSide& at) {
  AxisBoundary& along = axes[static_cast<std::size_t>(at.axis)];
  return at.is_low ? along.low : along.high;
}

Slopes slopes_of(const Expr& e, const Varied& varied) {
  Slopes slopes;
  add_slopes(e, 1.0, varied, slopes);
  return slopes;
}

Slopes weight_slopes(const std::string& field, const Side& side, const WallSide& at, int layers, const Varied& varied) {
  Slopes slopes;
  CoefficientSlopes of_coefficients;
  const auto coefficients = coefficients_of(side);
  for (int t = 0; t < side_coefficients; ++t) add_slopes(coefficients[t].value, 1.0, varied, of_coefficients[t]);
  const int within = side.on_wall && !at.is_low ? 1 : 0;  // layers inside the interior: the last cells themselves
  for (int k = layers + within - 1; k >= 0; --k) {
    const bool is_wall = side.on_wall && k == 0;
    const Slopes here = is_wall ? on_the_wall(of_coefficients, side, field, at, layers)
                                : beyond_the_wall(of_coefficients, side, k, field, at, layers);
    for (const auto& [name, value] : here) {
      const Expr* const farther = find(slopes, name);
      const Expr beyond = farther == nullptr ? Expr(0.0) : *farther;
      set(slopes, name, select(is_within(at, k + 1 - within, layers), value, beyond));
    }
  }
  for (auto& [name, value] : slopes) value = select(is_within(at, -within, layers), 0.0, value);
  return slopes;
}

Kernel adjoint_of_weights(const Fill& fill, const std::vector<std::string>& values, int layers, const Varied& varied,
                          DerivedNames& names, const DerivedField& bar_of_wall) {
  Slopes sums, walls;
  const std::vector<WallSide> sides = sides_with_varied_weights(fill.axes, varied);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Side& side = side_at(fill.axes, sides[i]);
    for (const auto& [name, slope] : weight_slopes(fill.field, side, sides[i], layers, varied))
      add(sums, names.of(name), -(slope * access(values[i])));
    const std::optional<std::string> wall = wall_field(side) ? bar_of_wall(*wall_field(side)) : std::nullopt;
    if (wall) add(walls, *wall, access(values[i]));
  }
  Kernel kernel{"", static_cast<int>(fill.axes.size()), {}, {}, {}, {}};
  for (const auto& [name, value] : sums) kernel.sums.push_back({name, value});
  for (const auto& [wall, value] : walls) kernel.stores.push_back({wall, true, value, {}});
  return kernel;
}

}  // namespace dpde::adjoint
