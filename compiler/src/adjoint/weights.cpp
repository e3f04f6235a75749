// SPDX-License-Identifier: Apache-2.0
#include "adjoint/weights.h"

#include <algorithm>

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

/// Adds x * de/dp for each param p of `e`, which is made of params and numbers.
void add_slopes(const Expr& e, const Expr& x, const Varied& varied, Slopes& slopes) {
  if (!is_varied(e, varied)) return;
  if (const Param* p = std::get_if<Param>(&e->kind)) {
    add(slopes, p->name, x);
    return;
  }
  if (const Select* s = std::get_if<Select>(&e->kind)) {
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

/// True in the grown region where the point is at most `layer` cells beyond that side.
Expr is_within(const WallSide& at, int layer, int grow) {
  return inside(along(at.axis, at.is_low ? layer - grow : grow - layer), grow);
}

/// What the params contribute to the change of mean*a + rise*b.
Slopes combined(const Slopes& by_a, const Slopes& by_b, const Expr& mean, const Expr& rise) {
  Slopes here;
  for (const auto& [name, slope] : by_a) add(here, name, slope * mean);
  for (const auto& [name, slope] : by_b) add(here, name, slope * rise);
  return here;
}

/// That at one place of the halo, with its image `way` cells inwards.
Slopes at_place(const Slopes& by_a, const Slopes& by_b, const std::string& field, const WallSide& at, int way,
                int layers) {
  const Offset image = along(at.axis, at.is_low ? way : -way);
  const Expr u = access(field, image), v = access(field), spacing = param(std::string("h") + "xyz"[at.axis]);
  Slopes here = combined(by_a, by_b, (u + v) / 2.0, (v - u) / (way * spacing));
  // the image is never farther out than the place: that is said for whoever asks how far out it is read
  for (auto& [name, value] : here) value = select(inside(image, layers), value, 0.0);
  return here;
}

/// That at a point on the wall, where the derivative is one-sided; with fewer than three cells it is of order 1, and a
/// high wall of a single cell does not follow from anything.
Slopes on_the_wall(const Slopes& by_a, const Slopes& by_b, const std::string& field, const WallSide& at, int layers) {
  const int inwards = at.is_low ? 1 : -1;
  const Offset near = along(at.axis, inwards), far = along(at.axis, 2 * inwards);
  const Expr w = access(field), u = access(field, near), spacing = param(std::string("h") + "xyz"[at.axis]);
  const Slopes three = combined(by_a, by_b, w, (3.0 * w - 4.0 * u + access(field, far)) / (2.0 * spacing));
  const Slopes two = combined(by_a, by_b, w, (w - u) / spacing);
  const auto has = [&](int cells) {
    return inside(along(at.axis, (cells - (at.is_low ? 0 : 1) + layers) * inwards), layers);
  };
  Slopes here;
  for (const auto& [name, value] : three) {
    const Expr any =
        select(inside(near, layers), select(has(3), select(inside(far, layers), value, 0.0), *find(two, name)), 0.0);
    add(here, name, at.is_low ? any : select(has(2), any, 0.0));
  }
  return here;
}

}  // namespace

bool has_varied_weights(const Side& side, const Varied& varied) {
  return side.kind == SideKind::mixed && (is_varied(side.a, varied) || is_varied(side.b, varied));
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

Slopes weight_slopes(const std::string& field, const Side& side, const WallSide& at, int layers, const Varied& varied) {
  Slopes by_a, by_b, slopes;
  add_slopes(side.a, 1.0, varied, by_a);
  add_slopes(side.b, 1.0, varied, by_b);
  const int on_wall = side.on_wall ? 1 : 0;
  const int within = side.on_wall && !at.is_low ? 1 : 0;  // layers that are no halo: the last cells themselves
  for (int k = layers + within - 1; k >= 0; --k) {
    const bool is_wall = side.on_wall && k == 0;
    const Slopes here = is_wall ? on_the_wall(by_a, by_b, field, at, layers)
                                : at_place(by_a, by_b, field, at, 2 * k + 1 - on_wall, layers);
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
