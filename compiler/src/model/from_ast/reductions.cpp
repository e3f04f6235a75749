// SPDX-License-Identifier: Apache-2.0
// mean(u), mean(u, y), max(u, over = (x, y)): reductions over all axes of the scene, or over those named.
#include <algorithm>
#include <utility>

#include "model/build.h"
#include "model/from_ast/coordinates.h"
#include "model/from_ast/expressions.h"

namespace dpde::model {

std::optional<Reduce::Kind> Expressions::reduction_called(const ast::Call& e) {
  if (e.callee == "mean") return Reduce::Kind::mean;
  if (e.callee == "sum") return Reduce::Kind::sum;
  if (e.callee == "integral") return Reduce::Kind::integral;
  const bool is_over_space = e.arguments.size() == 1 || (e.arguments.size() == 2 && e.arguments[1].name == "over");
  if (e.callee == "max" && is_over_space) return Reduce::Kind::max;
  if (e.callee == "min" && is_over_space) return Reduce::Kind::min;
  return std::nullopt;
}

Typed Expressions::reduction(Reduce::Kind kind, const ast::Call& e, SourceRange range) {
  if (purpose_ != Purpose::quantity && purpose_ != Purpose::equation)
    return refuse("the reduction " + e.callee, e.callee_range);
  if (wall_of(e) != nullptr) return wall_reduction(kind, e, range);
  const bool has_operand = !e.arguments.empty() && e.arguments[0].name.empty();
  if (!has_operand) {
    takes(e, 1);
    return {};
  }
  const SourceRange inside = e.arguments[0].value.range();
  const auto operand = as_number(any(e.arguments[0].value), inside);
  const auto over = axes_of_reduction(e);
  if (!operand || !over || is_too_large({Typed::Type::number, {*operand}}, inside)) return {};
  return number_of(Coordinates(draft_.problem, {range}).reduction(Reduce{kind, *operand, *over}));
}

std::optional<std::array<bool, 3>> Expressions::axes_of_reduction(const ast::Call& e) {
  constexpr std::array all{true, true, true};
  if (e.arguments.size() == 1) return all;
  std::array<bool, 3> over{};
  for (std::size_t i = 1; i < e.arguments.size(); ++i) {
    const ast::Argument& argument = e.arguments[i];
    const bool is_alone = argument.name == "over" && e.arguments.size() == 2;
    if (!is_alone && !argument.name.empty()) {
      draft_.sink.report("wrong-argument-count", argument.value.range(),
                         {e.callee, "what it reduces and axes", "one called " + argument.name},
                         "write " + e.callee + "(u, over = y)");
      return std::nullopt;
    }
    const auto* several = is_alone ? std::get_if<ast::Tuple>(&argument.value->kind) : nullptr;
    const bool fine = several ? std::all_of(several->elements.begin(), several->elements.end(),
                                            [&](const ast::Expr& axis) { return add_axis(axis, over); })
                              : add_axis(argument.value, over);
    if (!fine) return std::nullopt;
  }
  const bool is_all = std::all_of(over.begin(), over.begin() + axis_count(), [](bool along) { return along; });
  return is_all ? all : over;
}

bool Expressions::add_axis(const ast::Expr& e, std::array<bool, 3>& over) {
  const auto* name = std::get_if<ast::Name>(&e->kind);
  const int axis = name ? axis_of(draft_, name->name) : -1;
  if (axis < 0) {
    draft_.sink.report("unknown-axis", e.range(), {name ? name->name : "this"}, "write mean(u, y) or max(u, over = y)");
    return false;
  }
  if (!has_axis(axis, e.range())) return false;
  bool& along = over[static_cast<std::size_t>(axis)];
  if (along) draft_.sink.report("duplicate", e.range(), {"axis " + axis_name(axis)});
  return !std::exchange(along, true);
}

}  // namespace dpde::model
