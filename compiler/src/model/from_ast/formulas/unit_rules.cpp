// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/formulas/unit_rules.h"

#include <algorithm>

namespace dpde::model::unit_rules {

namespace {

MeasureList of_nothing() { return {Measure{}}; }

const ast::Argument* argument_called(const ast::Call& e, std::string_view name) {
  const auto found = std::ranges::find(e.arguments, name, &ast::Argument::name);
  return found == e.arguments.end() ? nullptr : &*found;
}

/// The names in an argument: y, or (x, y).
std::vector<std::string> names_in(const ast::Expr& e) {
  if (const auto* name = std::get_if<ast::Name>(&e->kind)) return {name->name};
  std::vector<std::string> names;
  if (const auto* tuple = std::get_if<ast::Tuple>(&e->kind)) {
    for (const ast::Expr& element : tuple->elements) {
      if (const auto* name = std::get_if<ast::Name>(&element->kind)) names.push_back(name->name);
    }
  }
  return names;
}

MeasureList operand_of(Measures& measures, const ast::Call& e, std::size_t i) {
  return measures.of(e.arguments[i].value);
}

/// Of a field that is only named: as in dt(u).
Measure of_named(Measures& measures, const ast::Expr& e) {
  const std::vector<std::string> names = names_in(e);
  return names.empty() ? Measure{} : measures.of_name(names.front());
}

/// Unknown for an axis that does not exist.
Measure of_axis(const MeasureList& axes, int axis) {
  return axis >= 0 && axis < std::ssize(axes) ? axes[static_cast<std::size_t>(axis)] : Measure{};
}

MeasureList over_coordinate(Measures& measures, const ast::Expr& operand, int axis, int order) {
  MeasureList list = measures.of(operand);
  for (Measure& part : list) part = quotient(part, power(measures.coordinate(axis), {order, 1}));
  return list;
}

/// f/L_i along each axis; for a vector known only if lengths are alike.
MeasureList gradient_of(const MeasuredAxes& axes, const MeasureList& f) {
  MeasureList list;
  if (axes.lengths.empty()) return of_nothing();
  if (axes.are_alike()) {
    for (const Measure& part : f) list.push_back(quotient(part, axes.lengths.front()));
    return f.size() == 1 ? list : of_nothing();
  }
  if (f.size() != 1) return of_nothing();
  for (const Measure& length : axes.lengths) list.push_back(quotient(f.front(), length));
  return list;
}

/// v_i/L_i, which must agree along all axes.
Measure divergence_of(Measures& measures, const MeasureList& v, SourceRange range) {
  const MeasureList& lengths = measures.axes().lengths;
  if (v.size() != 1 && v.size() != lengths.size()) return {};
  MeasureList list;
  for (std::size_t a = 0; a < lengths.size(); ++a) list.push_back(quotient(v[std::min(a, v.size() - 1)], lengths[a]));
  return list.empty() ? Measure{} : measures.alike(list, range);
}

MeasureList scaled(MeasureList list, const Measure& by) {
  for (Measure& part : list) part = product(part, by);
  return list;
}

Measure force_of(Measures& measures, const ast::Call& e) {
  return product(quotient(of_named(measures, e.arguments[1].value), measures.axes().time), measures.axes().volume());
}

}  // namespace

MeasureList along_axis(Measures& measures, const ast::Call& e, SourceRange) {
  return over_coordinate(measures, e.arguments[0].value, axis_of(e.callee.substr(1)), 1);
}

MeasureList along_named_axis(Measures& measures, const ast::Call& e, SourceRange) {
  const std::vector<std::string> names = names_in(e.arguments[1].value);
  const auto* order = e.arguments.size() == 3 ? std::get_if<ast::Number>(&e.arguments[2].value->kind) : nullptr;
  return over_coordinate(measures, e.arguments[0].value, names.empty() ? -1 : measures.axis_called(names.front()),
                         order == nullptr ? 1 : static_cast<int>(order->value));
}

MeasureList laplacian(Measures& measures, const ast::Call& e, SourceRange range) {
  const MeasureList f = operand_of(measures, e, 0);
  MeasureList per_area;
  for (const Measure& length : measures.axes().lengths) per_area.push_back(power(length, {-2, 1}));
  return scaled(f, per_area.empty() ? Measure{} : measures.alike(per_area, range));
}

MeasureList gradient(Measures& measures, const ast::Call& e, SourceRange) {
  return gradient_of(measures.axes(), operand_of(measures, e, 0));
}

MeasureList divergence(Measures& measures, const ast::Call& e, SourceRange range) {
  return {divergence_of(measures, operand_of(measures, e, 0), range)};
}

MeasureList advection(Measures& measures, const ast::Call& e, SourceRange) {
  const Measure rate = divergence_of(measures, operand_of(measures, e, 0), e.arguments[0].value.range());
  return scaled(operand_of(measures, e, 1), rate);
}

MeasureList curl(Measures& measures, const ast::Call& e, SourceRange) {
  const MeasureList v = operand_of(measures, e, 0);
  return v.size() == 1 && measures.axes().are_alike() ? gradient_of(measures.axes(), v) : of_nothing();
}

MeasureList poisson_bracket(Measures& measures, const ast::Call& e, SourceRange) {
  const MeasureList& lengths = measures.axes().lengths;
  const Measure area = lengths.size() >= 2 ? product(lengths[0], lengths[1]) : Measure{};
  return {quotient(product(measures.one(e.arguments[0].value), measures.one(e.arguments[1].value)), area)};
}

MeasureList integral(Measures& measures, const ast::Call& e, SourceRange) {
  const ast::Argument *from = argument_called(e, "from"), *to = argument_called(e, "to");
  if (from != nullptr && to != nullptr) {
    const MeasureList ends = measures.common({from->value, to->value}, "");
    return {product(measures.one(e.arguments[0].value), ends.front())};
  }
  const Measure of_operand = measures.one(e.arguments[0].value);
  const MeasuredAxes& axes = measures.axes();
  if (const ast::Argument* wall = argument_called(e, "at")) {
    const std::vector<std::string> names = names_in(wall->value);
    const int axis = names.empty() ? -1 : measures.axis_called(names.front().substr(0, names.front().find('.')));
    return {product(of_operand, quotient(axes.volume(), of_axis(axes.lengths, axis)))};
  }
  if (e.arguments.size() == 1) return {product(of_operand, axes.volume())};
  Measure all = of_operand;
  for (std::size_t i = 1; i < e.arguments.size(); ++i) {
    for (const std::string& name : names_in(e.arguments[i].value))
      all = product(all, of_axis(axes.lengths, measures.axis_called(name)));
  }
  return {all};
}

MeasureList reduction(Measures& measures, const ast::Call& e, SourceRange) {
  return {measures.one(e.arguments[0].value)};
}

MeasureList extreme(Measures& measures, const ast::Call& e, SourceRange range) {
  const bool is_over_space = e.arguments.size() == 1 || (e.arguments.size() == 2 && !e.arguments[1].name.empty());
  if (is_over_space) return reduction(measures, e, range);
  return measures.common({e.arguments[0].value, e.arguments[1].value}, "");
}

MeasureList sample(Measures& measures, const ast::Call& e, SourceRange) {
  if (const ast::Argument* at = argument_called(e, "at"))
    measures.fit(at->value, measures.axes().coordinates, "a place");
  return operand_of(measures, e, 0);
}

MeasureList inject(Measures& measures, const ast::Call& e, SourceRange range) {
  return {quotient(sample(measures, e, range).front(), measures.axes().volume())};
}

MeasureList force(Measures& measures, const ast::Call& e, SourceRange) { return {force_of(measures, e)}; }

MeasureList torque(Measures& measures, const ast::Call& e, SourceRange) {
  const Measure force = force_of(measures, e);
  const MeasuredAxes& axes = measures.axes();
  if (const ast::Argument* about = argument_called(e, "about")) measures.fit(about->value, axes.coordinates, "a place");
  return {axes.are_alike() && !axes.lengths.empty() ? product(force, axes.lengths.front()) : Measure{}};
}

MeasureList angle(Measures& measures, const ast::Call& e, SourceRange) {
  measures.common({e.arguments[0].value, e.arguments[1].value}, "");
  return {{Measure::Kind::number}};
}

MeasureList choice(Measures& measures, const ast::Call& e, SourceRange) {
  operand_of(measures, e, 0);
  return measures.common({e.arguments[1].value, e.arguments[2].value}, "");
}

MeasureList operand(Measures& measures, const ast::Call& e, SourceRange) { return operand_of(measures, e, 0); }

MeasureList square_root(Measures& measures, const ast::Call& e, SourceRange) {
  return {power(measures.one(e.arguments[0].value), {1, 2})};
}

MeasureList sign(Measures& measures, const ast::Call& e, SourceRange) {
  operand_of(measures, e, 0);
  return {{Measure::Kind::number}};
}

MeasureList pure_number(Measures& measures, const ast::Call& e, SourceRange) {
  measures.pure(e.arguments[0].value, e.callee);
  return {{Measure::Kind::number}};
}

MeasureList product_of_components(Measures& measures, const ast::Call& e, SourceRange range) {
  const MeasureList a = operand_of(measures, e, 0), b = operand_of(measures, e, 1);
  return {measures.alike(Measures::product_of(a, b, BinaryOp::multiply), range)};
}

MeasureList product_of_lists(Measures& measures, const ast::Call& e, SourceRange) {
  const MeasureList a = operand_of(measures, e, 0), b = operand_of(measures, e, 1);
  return a.size() == 1 && b.size() == 1 ? MeasureList{product(a[0], b[0])} : of_nothing();
}

MeasureList trace(Measures& measures, const ast::Call& e, SourceRange range) {
  return {measures.alike(operand_of(measures, e, 0), range)};
}

MeasureList turned(Measures& measures, const ast::Call& e, SourceRange) {
  const MeasureList s = operand_of(measures, e, 0);
  return s.size() == 1 ? s : of_nothing();
}

MeasureList rate(Measures& measures, const ast::Call& e, SourceRange) {
  return {quotient(of_named(measures, e.arguments[0].value), measures.axes().time)};
}

MeasureList number(Measures&, const ast::Call&, SourceRange) { return {{Measure::Kind::number}}; }

}  // namespace dpde::model::unit_rules
