// SPDX-License-Identifier: Apache-2.0
// Units of what functions and operators make.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/from_ast/formulas/expressions.h"
#include "model/from_ast/formulas/measures.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

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

}  // namespace

/// f/L_i along each axis; of a vector known where lengths are alike.
MeasureList Measures::gradient(const MeasureList& f) const {
  MeasureList list;
  if (axes_.lengths.empty()) return of_nothing();
  if (axes_.are_alike()) {
    for (const Measure& part : f) list.push_back(quotient(part, axes_.lengths.front()));
    return f.size() == 1 ? list : of_nothing();
  }
  if (f.size() != 1) return of_nothing();
  for (const Measure& length : axes_.lengths) list.push_back(quotient(f.front(), length));
  return list;
}

/// v_i/L_i, alike along all axes.
Measure Measures::divergence(const MeasureList& v, SourceRange range) {
  if (v.size() != 1 && v.size() != axes_.lengths.size()) return {};
  MeasureList list;
  for (std::size_t a = 0; a < axes_.lengths.size(); ++a)
    list.push_back(quotient(v[std::min(a, v.size() - 1)], axes_.lengths[a]));
  return list.empty() ? Measure{} : alike(list, range);
}

Measure Measures::laplacian(SourceRange range) {
  MeasureList list;
  for (const Measure& length : axes_.lengths) list.push_back(power(length, {-2, 1}));
  return list.empty() ? Measure{} : alike(list, range);
}

MeasureList Measures::along(const ast::Expr& operand, const Measure& coordinate, int order) {
  MeasureList list = of(operand);
  for (Measure& part : list) part = quotient(part, power(coordinate, {order, 1}));
  return list;
}

/// What is made of derivatives; nullopt of other calls.
std::optional<MeasureList> Measures::derivative(const ast::Call& e, SourceRange range) {
  const std::string& f = e.callee;
  const auto operand = [&](std::size_t i) { return of(e.arguments[i].value); };
  const auto coordinate = [&](int axis) {
    return axis >= 0 && axis < std::ssize(axes_.coordinates) ? axes_.coordinates[static_cast<std::size_t>(axis)]
                                                             : Measure{};
  };
  if (f == "dx" || f == "dy" || f == "dz")
    return along(e.arguments[0].value, coordinate(axis_of(std::string_view(f).substr(1))), 1);
  if (f == "d") {
    const std::vector<std::string> names = names_in(e.arguments[1].value);
    const auto* order = e.arguments.size() == 3 ? std::get_if<ast::Number>(&e.arguments[2].value->kind) : nullptr;
    return along(e.arguments[0].value, names.empty() ? Measure{} : coordinate(axis_of(elaboration_, names.front())),
                 order == nullptr ? 1 : static_cast<int>(order->value));
  }
  if (f == "lap") {
    MeasureList list = operand(0);
    const Measure per_area = laplacian(range);
    for (Measure& part : list) part = product(part, per_area);
    return list;
  }
  if (f == "grad") return gradient(operand(0));
  if (f == "div") return MeasureList{divergence(operand(0), range)};
  if (f == "advect") {
    const Measure rate = divergence(operand(0), e.arguments[0].value.range());
    MeasureList list = operand(1);
    for (Measure& part : list) part = product(part, rate);
    return list;
  }
  if (f == "curl") {
    const MeasureList v = operand(0);
    return v.size() == 1 && axes_.are_alike() ? gradient(v) : of_nothing();
  }
  if (f != "bracket") return std::nullopt;
  const bool is_plane = axes_.lengths.size() >= 2;
  const Measure area = is_plane ? product(axes_.lengths[0], axes_.lengths[1]) : Measure{};
  return MeasureList{quotient(product(one(e.arguments[0].value), one(e.arguments[1].value)), area)};
}

/// integral(f(s), s, from = a, to = b): s has the unit of its ends; nullopt of other calls.
std::optional<MeasureList> Measures::quadrature(const ast::Call& e) {
  const ast::Argument *from = argument_called(e, "from"), *to = argument_called(e, "to");
  if (e.callee != "integral" || from == nullptr || to == nullptr) return std::nullopt;
  const MeasureList ends = common({from->value, to->value}, "");
  Arguments inside = arguments_ == nullptr ? Arguments{} : *arguments_;
  for (const std::string& variable : names_in(e.arguments[1].value)) inside[variable] = ends;
  const Arguments* outside = std::exchange(arguments_, &inside);
  const Measure value = one(e.arguments[0].value);
  arguments_ = outside;
  return MeasureList{product(value, ends.front())};
}

/// mean, sum, integral, max and min over space; nullopt of other calls.
std::optional<MeasureList> Measures::reduction(const ast::Call& e) {
  const bool is_over_space = e.arguments.size() == 1 || (e.arguments.size() == 2 && !e.arguments[1].name.empty());
  const bool is_extreme = (e.callee == "max" || e.callee == "min") && is_over_space;
  if (e.callee != "mean" && e.callee != "sum" && e.callee != "integral" && !is_extreme) return std::nullopt;
  const Measure of_operand = one(e.arguments[0].value);
  if (e.callee != "integral") return MeasureList{of_operand};
  if (const ast::Argument* wall = argument_called(e, "at")) {
    const std::vector<std::string> names = names_in(wall->value);
    const int axis = names.empty() ? -1 : axis_of(elaboration_, names.front().substr(0, names.front().find('.')));
    const bool is_axis = axis >= 0 && axis < std::ssize(axes_.lengths);
    const Measure across = is_axis ? axes_.lengths[static_cast<std::size_t>(axis)] : Measure{};
    return MeasureList{product(of_operand, quotient(axes_.volume(), across))};
  }
  if (e.arguments.size() == 1) return MeasureList{product(of_operand, axes_.volume())};
  Measure all = of_operand;
  for (std::size_t i = 1; i < e.arguments.size(); ++i) {
    for (const std::string& name : names_in(e.arguments[i].value)) {
      const int axis = axis_of(elaboration_, name);
      const bool is_axis = axis >= 0 && axis < std::ssize(axes_.lengths);
      all = product(all, is_axis ? axes_.lengths[static_cast<std::size_t>(axis)] : Measure{});
    }
  }
  return MeasureList{all};
}

/// sample, inject, force_on and torque_on; nullopt of other calls.
std::optional<MeasureList> Measures::at_point(const ast::Call& e) {
  if (e.callee == "sample" || e.callee == "inject") {
    if (const ast::Argument* at = argument_called(e, "at")) fit(at->value, axes_.coordinates, "a place");
    const MeasureList value = of(e.arguments[0].value);
    return e.callee == "sample" ? value : MeasureList{quotient(value.front(), axes_.volume())};
  }
  if (e.callee != "force_on" && e.callee != "torque_on") return std::nullopt;
  const Measure force = product(quotient(one(e.arguments[1].value), axes_.time), axes_.volume());
  if (e.callee == "force_on") return MeasureList{force};
  if (const ast::Argument* about = argument_called(e, "about")) fit(about->value, axes_.coordinates, "a place");
  return MeasureList{axes_.are_alike() ? product(force, axes_.lengths.front()) : Measure{}};
}

/// Functions of numbers: what they take and what they make.
MeasureList Measures::elementary(const ast::Call& e) {
  const std::string& f = e.callee;
  if (f == "if") {
    of(e.arguments[0].value);
    return common({e.arguments[1].value, e.arguments[2].value}, "");
  }
  if (f == "min" || f == "max") return common({e.arguments[0].value, e.arguments[1].value}, "");
  if (f == "abs" || f == "norm" || f == "interpolate" || f == "average" || f == "band_pass") {
    const MeasureList list = of(e.arguments[0].value);
    return f == "norm" ? MeasureList{alike(list, e.arguments[0].value.range())} : list;
  }
  if (f == "sqrt") return {power(one(e.arguments[0].value), {1, 2})};
  if (f == "sign") {
    of(e.arguments[0].value);
    return {{Measure::Kind::number}};
  }
  pure(e.arguments[0].value, f);
  return {{Measure::Kind::number}};
}

void Measures::note_call(Diagnostic& diagnostic) const {
  if (!calls_.empty()) diagnostic.notes.push_back({calls_.front(), "with the units of this call"});
}

/// The body, with the units of this call: what does not fit is shown in it.
MeasureList Measures::user_call(const ast::Function& function, const ast::Call& e) {
  constexpr std::size_t deepest = 64;
  if (calls_.size() > deepest) return of_nothing();
  Arguments arguments;
  for (std::size_t i = 0; i < std::min(function.parameters.size(), e.arguments.size()); ++i)
    arguments.emplace(function.parameters[i].name, of(e.arguments[i].value));
  const Arguments* outer = std::exchange(arguments_, &arguments);
  calls_.push_back(e.callee_range);
  MeasureList list = of(function.body);
  calls_.pop_back();
  arguments_ = outer;
  return list;
}

MeasureList Measures::call(const ast::Call& e, SourceRange range) {
  if (e.arguments.empty()) return of_nothing();
  const std::string& f = e.callee;
  if (const auto* function = find_declaration<ast::Function>(elaboration_.file, f)) return user_call(*function, e);
  if (f == "random_field" || f == "random_signal" || f == "noise") return {{Measure::Kind::number}};
  if (f == "dt") {
    const MeasureList list = of(e.arguments[0].value);
    return {quotient(list.front(), axes_.time)};
  }
  if (find_network(elaboration_, f) != nullptr || !Expressions::is_built_in(f) || f == "load") {
    for (const ast::Argument& argument : e.arguments) of(argument.value);
    return of_nothing();
  }
  if (const auto list = derivative(e, range)) return *list;
  if (const auto list = quadrature(e)) return *list;
  if (const auto list = reduction(e)) return *list;
  if (const auto list = at_point(e)) return *list;
  const auto operand = [&](std::size_t i) { return of(e.arguments[i].value); };
  if (f == "dot" || f == "inner") return {alike(product_of(operand(0), operand(1), BinaryOp::multiply), range)};
  if (f == "outer" || f == "cross") {
    const MeasureList a = operand(0), b = operand(1);
    return a.size() == 1 && b.size() == 1 ? MeasureList{product(a[0], b[0])} : of_nothing();
  }
  if (f == "sym" || f == "transpose" || f == "trace") {
    const MeasureList s = operand(0);
    return f == "trace" ? MeasureList{alike(s, range)} : s.size() == 1 ? s : of_nothing();
  }
  return elementary(e);
}

}  // namespace dpde::model
