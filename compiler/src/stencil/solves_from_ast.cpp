// SPDX-License-Identifier: Apache-2.0
#include "stencil/solves_from_ast.h"

#include "stencil/expr_from_ast.h"
#include "stencil/networks_from_ast.h"
#include "syntax/item_kinds.h"

namespace dpde::stencil {

std::optional<SolveBy> read_solve_by(const ast::SolveItem& source, DiagnosticSink& sink) {
  SolveBy by;
  if (source.method) {
    const std::optional<SolveMethod> method = find_solve_method(source.method->name);
    if (!method) {
      std::vector<std::string> names;
      for (int i = 0; i <= static_cast<int>(SolveMethod::bicgstab); ++i)
        names.emplace_back(name_of(static_cast<SolveMethod>(i)));
      sink.report("bad-program", source.method->range, {source.method->name + " is no method to solve by"},
                  did_you_mean(source.method->name, names));
      return std::nullopt;
    }
    by.method = *method;
  }
  if (!source.tolerance) return by;
  const auto* number = std::get_if<ast::Number>(&(*source.tolerance)->kind);
  if (number == nullptr || !(number->value > 0 && number->value < 1)) {
    sink.report("bad-program", source.tolerance->range(), {"a tolerance is a number between 0 and 1"}, "as 1e-10");
    return std::nullopt;
  }
  by.tolerance = number->value;
  return by;
}

std::vector<std::string> fields_named(const ast::Item& item) {
  using Names = std::vector<std::string>;
  const auto names_of = [](const std::vector<ast::Identifier>& all) {
    Names names;
    for (const ast::Identifier& one : all) names.push_back(one.name);
    return names;
  };
  return match(
      item.kind, [&](const ast::RepeatItem& repeat) { return names_of(repeat.to); },
      [](const ast::SwapItem& swap) { return Names{swap.state.name}; },
      [](const ast::ReduceItem& reduce) {
        return Names{reduce.field.name, reduce.result.name};
      },
      [](const ast::TransformItem& transform) {
        Names names;
        for (const ast::TransformItem::Term& term : transform.terms) names.push_back(term.field.name);
        names.push_back(transform.result.name);
        return names;
      },
      [](const ast::SolveItem& solve) {
        return Names{solve.image.name, solve.right.name, solve.unknown.name};
      },
      [](const ast::ApplyItem& apply) { return fields_of(apply); },
      [](const ast::OneOf<ast::FillItem, ast::RunItem, ast::StackItem, ast::KeepItem, ast::AxesItem> auto&) {
        return Names();
      },
      [](const ast::OutsidePrograms auto&) { return Names(); });
}

}  // namespace dpde::stencil
