// SPDX-License-Identifier: Apache-2.0
#include "random/model_expression.h"

#include <fmt/format.h>

#include <algorithm>

namespace dpde::testing {

Place place_of(const Quantity& quantity, int axis) {
  if (quantity.on == Quantity::On::one_place) return quantity.place;
  Place place{};
  place[static_cast<std::size_t>(axis)] = true;
  return place;
}

Part ModelExpressions::number(double low, double high) {
  const std::string text = fmt::format("{:.3g}", random_.uniform(low, high));
  return expression(text[0] == '-' ? "(" + text + ")" : text);
}

Part ModelExpressions::uniform() {
  const int kind = random_.weighted({names_.numbers.empty() ? 0 : 6, 3, names_.time ? 1 : 0});
  if (kind == 0) return expression(any(names_.numbers));
  return kind == 1 ? number(0.2, 1.5) : expression("cos(3*t)");
}

bool ModelExpressions::may_be_read(const Quantity& quantity, int axis) const {
  if (derived_ == 0 || !quantity.is_given) return true;
  const Place place = place_of(quantity, axis);
  for (std::size_t a = 0; a < names_.axes.size(); ++a) {
    if (place[a] && !names_.axes[a].is_periodic) return false;
  }
  return true;
}

std::vector<Part> ModelExpressions::components_at(const Place& place) {
  std::vector<Part> found;
  for (const Quantity& q : names_.quantities) {
    for (int axis = 0; axis < (q.is_vector ? rank() : 1); ++axis) {
      if (place_of(q, axis) == place && may_be_read(q, axis))
        found.push_back(expression(q.is_vector ? q.name + "." + axis_name(axis) : q.name));
    }
  }
  return found;
}

Part ModelExpressions::leaf(const Place& place) {
  const std::vector<Part> here = components_at(place);
  switch (random_.weighted({here.empty() ? 0 : 60, 20, 8})) {
    case 0: return any(here);
    case 1: return uniform();
    default:
      return expression(fmt::format("sin({:.2g}*{})", random_.uniform(0.5, 2.0), axis_name(random_.below(rank()))));
  }
}

Place ModelExpressions::any_place() {
  if (names_.quantities.empty()) return centre;
  const Quantity& q = any(names_.quantities);
  return place_of(q, random_.below(rank()));
}

Part ModelExpressions::differentiable(const Place& place, int depth) {
  ++derived_;
  Part result = scalar(place, depth);
  --derived_;
  return result;
}

/// Something from elsewhere; it has to hold a field.
Part ModelExpressions::interpolated(const Place& place, int depth) {
  ++derived_;
  const Place from = any_place();
  const std::vector<Part> there = components_at(from);
  Part result = leaf(place);
  if (from != place && !there.empty()) {
    const Part factor = any(there);
    result = depth > 0 && random_.percent(40) ? expression("interpolate(@*@)", {factor, scalar(from, depth - 1)})
                                              : expression("interpolate(@)", {factor});
  }
  --derived_;
  return result;
}

Part ModelExpressions::derivative(const Place& place, int depth) {
  const int axis = random_.below(rank());
  const std::string& a = axis_name(axis);
  const Place other = toggled(place, axis);
  ++derived_;
  const bool from_other = !components_at(other).empty() && random_.percent(60);
  --derived_;
  switch (random_.weighted({6, 2, 2, 2})) {
    case 0: return expression("d" + a + "(@)", {differentiable(from_other ? other : place, depth - 1)});
    case 1: return expression("d(@, " + a + ", 2)", {differentiable(place, depth - 1)});
    case 2: return expression("lap(@)", {differentiable(place, depth - 1)});
    default:
      return expression("0.02*d(@, " + a + fmt::format(", {})", 3 + random_.below(2)), {differentiable(place, 0)});
  }
}

Part ModelExpressions::reduction(const Place& place, int depth) {
  constexpr const char* kinds[] = {"mean", "sum", "integral", "max", "min"};
  const int kind = random_.weighted({5, 1, 3, 1, 1});
  const std::string scale = kind == 1 ? "0.05*" : "";
  if (rank() == 1 || random_.percent(55))
    return expression(scale + kinds[kind] + "(@)", {scalar(any_place(), depth - 1)});
  const int axis = random_.below(rank());
  const Place from = random_.percent(50) ? place : toggled(place, axis);
  return expression(scale + kinds[kind] + "(@, over = " + axis_name(axis) + ")", {scalar(from, depth - 1)});
}

Part ModelExpressions::function(const Place& place, int depth) {
  switch (random_.below(11)) {
    case 0: return expression("sin(@)", {scalar(place, depth - 1)});
    case 1: return expression("tanh(@)", {scalar(place, depth - 1)});
    case 2: return expression("exp(-(@)^2)", {scalar(place, depth - 1)});
    case 3: return expression("sqrt(1 + (@)^2)", {scalar(place, depth - 1)});
    case 4: return expression("abs(@)", {scalar(place, depth - 1)});
    case 5: return expression("max(@, @)", {scalar(place, depth - 1), scalar(place, depth - 1)});
    case 6: return expression("min(@, @)", {scalar(place, depth - 1), scalar(place, depth - 1)});
    case 7:
      return expression("if(@ < @, @, @)", {scalar(place, depth - 1), number(0.3, 1.7), scalar(place, depth - 1),
                                            scalar(place, depth - 1)});
    case 8: return expression("log(1 + (@)^2)", {scalar(place, depth - 1)});
    case 9: return expression("(1 + (@)^2)^@", {scalar(place, depth - 1), number(-1, 1)});
    default: break;
  }
  if (names_.functions.empty()) return expression("cos(@)", {scalar(place, depth - 1)});
  return expression(any(names_.functions) + "(@, @)", {scalar(place, depth - 1), scalar(place, depth - 1)});
}

Part ModelExpressions::scalar(const Place& place, int depth) {
  if (depth <= 0 || random_.percent(20)) return leaf(place);
  std::vector<const Quantity*> together;
  for (const Quantity* q : vectors()) {
    if (q->on == Quantity::On::one_place && q->place == place && may_be_read(*q, 0)) together.push_back(q);
  }
  const int derivatives = names_.derivatives ? 10 : 0;
  switch (random_.weighted({16, 10, 16, 6, 12, derivatives, names_.derivatives ? 8 : 0, names_.reductions ? 5 : 0,
                            together.empty() ? 0 : 6, names_.operators.empty() || !names_.derivatives ? 0 : 6})) {
    case 0: return expression("(@ + @)", {scalar(place, depth - 1), scalar(place, depth - 1)});
    case 1: return expression("(@ - @)", {scalar(place, depth - 1), scalar(place, depth - 1)});
    case 2: return expression("@*@", {leaf(place), scalar(place, depth - 1)});
    case 3: return expression("@/(1.5 + (@)^2)", {leaf(place), scalar(place, depth - 1)});
    case 4: return function(place, depth);
    case 5: return derivative(place, depth);
    case 6: return interpolated(place, depth);
    case 7: return reduction(place, depth);
    case 8: break;
    default: return expression(any(names_.operators) + "(@)", {differentiable(place, depth - 1)});
  }
  const Quantity& v = *any(together);
  switch (random_.below(3)) {
    case 0: return expression("norm(@)", {vector(v, depth - 1)});
    case 1: return expression("|@|", {vector(v, 0)});
    default: return expression("dot(@, @)", {vector(v, depth - 1), vector(v, 0)});
  }
}

std::vector<const Quantity*> ModelExpressions::vectors() {
  std::vector<const Quantity*> found;
  for (const Quantity& q : names_.quantities) {
    if (q.is_vector) found.push_back(&q);
  }
  return found;
}

Part ModelExpressions::tuple_at(const Quantity& like, int depth) {
  Part result{Part::Kind::tuple, "", {}};
  for (int axis = 0; axis < rank(); ++axis) result.parts.push_back(scalar(place_of(like, axis), depth));
  return result;
}

Part ModelExpressions::vector(const Quantity& like, int depth) {
  std::vector<Part> alike;
  for (const Quantity* q : vectors()) {
    if (q->on == like.on && q->place == like.place && may_be_read(*q, 0)) alike.push_back(expression(q->name));
  }
  const bool on_faces = like.on == Quantity::On::faces;
  if (alike.empty()) return expression("grad(@)", {differentiable(on_faces ? centre : like.place, 0)});
  if (depth <= 0 || random_.percent(30)) return any(alike);
  switch (random_.weighted({4, 4, 3, names_.derivatives ? 5 : 0, rank() > 1 ? 3 : 0, names_.derivatives ? 2 : 0})) {
    case 0: return expression("(@ + @)", {vector(like, depth - 1), vector(like, depth - 1)});
    case 1: return expression("@*@", {uniform(), vector(like, depth - 1)});
    case 2: return expression("@*@", {on_faces ? uniform() : scalar(like.place, depth - 1), vector(like, depth - 1)});
    case 3: return expression("grad(@)", {differentiable(on_faces ? centre : like.place, depth - 1)});
    case 4: return expression("@", {tuple_at(like, depth - 1)});
    default: break;
  }
  ++derived_;
  Part inner = vector(like, depth - 1);
  --derived_;
  return expression(random_.percent(50) ? "lap(@)" : "div(2*sym(grad(@)))", {inner});
}

Part ModelExpressions::formula() {
  const std::string& a = axis_name(random_.below(rank()));
  switch (random_.below(4)) {
    case 0: return expression("sin(@*" + a + ")", {number(0.5, 2.5)});
    case 1: return expression("cos(" + a + " + @)", {number(0.0, 3.0)});
    case 2: return expression("exp(-(" + a + " - @)^2)", {number(0.0, 2.0)});
    default: return number(-1, 1);
  }
}

Part ModelExpressions::velocity() {
  const std::vector<const Quantity*> all = vectors();
  if (!all.empty() && random_.percent(60)) return expression(any(all)->name);
  Part result{Part::Kind::tuple, "", {}};
  for (int axis = 0; axis < rank(); ++axis) {
    result.parts.push_back(random_.percent(50) ? expression("@*@", {uniform(), formula()}) : scalar(any_place(), 1));
  }
  return result;
}

Part ModelExpressions::term(const Part& self, const Place& place) {
  std::vector<std::string> to_diverge;
  for (const Quantity* q : vectors()) {
    const bool fits = q->on == Quantity::On::faces ? place == centre : place == q->place;
    if (fits && !(q->is_given && q->on == Quantity::On::faces)) to_diverge.push_back(q->name);
  }
  switch (random_.weighted({20, 10, 12, 12, 12, to_diverge.empty() ? 0 : 14, names_.reductions ? 6 : 0, 5})) {
    case 0: return expression("@*lap(@)", {uniform(), self});
    case 1: return expression("div((1 + 0.3*(@)^2)*grad(@))", {differentiable(place, 0), self});
    case 2: return expression("@*@*(1 - (@)^2)", {uniform(), self, scalar(place, 1)});
    case 3: return expression("@*@", {leaf(place), derivative(place, 2)});
    case 4: return expression("@", {scalar(place, 3)});
    case 5: return expression("div(@*@)", {uniform(), expression(any(to_diverge))});
    case 6: return expression("@*(@ - @)", {uniform(), self, reduction(place, 2)});
    default: return expression("@*cos(t)", {formula()});
  }
}

Part ModelExpressions::vector_term(const Quantity& self) {
  switch (random_.weighted({5, 4, 4})) {
    case 0: return expression("@*lap(@)", {uniform(), expression(self.name)});
    case 1: return expression("grad(@)", {differentiable(self.on == Quantity::On::faces ? centre : self.place, 2)});
    default: return vector(self, 2);
  }
}

}  // namespace dpde::testing
