// SPDX-License-Identifier: Apache-2.0
// What a scene gives beside numbers: initial states, exact solutions, coefficient fields, observables.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/expressions.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

bool task_gives_start(const Draft& draft, const std::string& name) {
  if (!draft.task) return false;
  for (const auto& [unknown, range] : items_of<ast::UnknownItem>(draft.task->items)) {
    if (unknown.initial && unknown.name.name == name && unknown.from) return true;
  }
  return false;
}

/// Calls `bind` with each item and its state, once a state.
template <class Item, class Bind>
std::map<std::string, SourceRange> for_each_state(Draft& draft, const std::string& article, const std::string& word,
                                                  const Bind& bind) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<Item>(draft.scene->items)) {
    const std::string& name = item.field.name;
    if (!find_state(draft, item.field, article + " " + word)) continue;
    const auto [first, is_new] = seen.emplace(name, item.field.range);
    if (!is_new) report_duplicate(draft, fmt::format("the {} of {}", word, name), item.field.range, first->second);
    for (State& state : draft.problem.states) {
      if (is_new && state.name == name) bind(item, state);
    }
  }
  return seen;
}

/// The part of `e` that keeps it from being a sum of reductions with constant factors, or nullptr.
const Expr* find_mistake(const Expr& e) {
  if (std::holds_alternative<Reduce>(e->kind)) return nullptr;
  if (!holds_reduction(e)) return is_uniform(e) ? nullptr : &e;
  if (const auto* neg = std::get_if<Neg>(&e->kind)) return find_mistake(neg->operand);
  const auto* b = std::get_if<Binary>(&e->kind);
  if (!b) return &e;
  const bool in_left = holds_reduction(b->left), in_right = holds_reduction(b->right);
  const bool is_product = b->op == BinaryOp::multiply && !(in_left && in_right);
  const bool is_sum = b->op == BinaryOp::add || b->op == BinaryOp::subtract;
  if (!is_sum && !is_product && !(b->op == BinaryOp::divide && !in_right)) return &e;
  const Expr* left = find_mistake(b->left);
  return left ? left : find_mistake(b->right);
}

}  // namespace

std::optional<std::string> file_of(Draft& draft, const ast::Expr& e) {
  const auto* call = std::get_if<ast::Call>(&e->kind);
  if (!call || call->callee != "load") return std::nullopt;
  const bool one = call->arguments.size() == 1 && call->arguments[0].name.empty();
  const auto* text = one ? std::get_if<ast::Text>(&call->arguments[0].value->kind) : nullptr;
  if (text && !text->value.empty()) return text->value;
  draft.sink.report("bad-load", e.range(), {}, "write load(\"name.npy\")");
  return "";
}

Source source_of(Draft& draft, const ast::Expr& e, Purpose purpose, const std::string& subject) {
  Source source;
  source.origin = {e.range()};
  if (const auto file = file_of(draft, e)) {
    source.file = *file;
  } else {
    source.formula = Expressions(draft, purpose, subject).number(e);
  }
  return source;
}

void bind_states(Draft& draft) {
  const auto started =
      for_each_state<ast::InitialItem>(draft, "an", "initial state", [&](const ast::InitialItem& item, State& state) {
        state.initial = source_of(draft, item.value, Purpose::initial, state.name);
      });
  for (const State& state : draft.problem.states) {
    if (started.contains(state.name) || task_gives_start(draft, state.name)) continue;
    draft.sink.report("missing-initial", draft.scene->name.range, {state.name},
                      fmt::format("write initial {} = 0 in scene {}", state.name, draft.problem.scene));
  }
  for_each_state<ast::ExactItem>(draft, "an", "exact solution", [&](const ast::ExactItem& item, State& state) {
    state.exact = Expressions(draft, Purpose::exact, state.name).number(item.value);
  });
}

void bind_coefficients(Draft& draft) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::ValueItem>(draft.scene->items)) {
    for (Coefficient& coefficient : draft.problem.coefficients) {
      if (coefficient.name != item.name.name) continue;
      const auto [first, is_new] = seen.emplace(coefficient.name, item.name.range);
      if (!is_new) report_duplicate(draft, coefficient.name, item.name.range, first->second);
      if (is_new) coefficient.value = source_of(draft, item.value, Purpose::coefficient, coefficient.name);
    }
  }
  for (const Coefficient& coefficient : draft.problem.coefficients) {
    if (seen.contains(coefficient.name)) continue;
    Diagnostic& diagnostic = draft.sink.report(
        "missing-value", draft.scene->name.range, {"coefficient", coefficient.name},
        fmt::format("write {0} = 1 or {0} = load(\"name.npy\") in scene {1}", coefficient.name, draft.problem.scene));
    diagnostic.notes.push_back({draft.scope.find(coefficient.name)->declared, "it is declared here"});
  }
}

std::optional<Expr> quantity_of(Draft& draft, const ast::Expr& e, const std::string& what) {
  const auto value = Expressions(draft, Purpose::quantity, what).number(e);
  if (!value) return std::nullopt;
  const Expr* mistake = find_mistake(*value);
  if (!mistake) return value;
  const SourceRange range = (*mistake)->origin.range;
  draft.sink.report(
      "not-reduced", range.is_known() ? range : e.range(), {what},
      "write for example mean((u - v)^2) + 0.1*integral(u^2); other functions belong inside the brackets");
  return std::nullopt;
}

bool can_name_a_quantity(Draft& draft, const ast::Identifier& name, std::map<std::string, SourceRange>& seen) {
  if (is_reserved(name.name)) {
    draft.sink.report("reserved-name", name.range, {name.name, "number"}, "choose another name");
    return false;
  }
  const Meaning* meaning = draft.scope.find(name.name);
  const auto [first, is_new] = seen.emplace(name.name, name.range);
  if (meaning || !is_new) report_duplicate(draft, name.name, name.range, meaning ? meaning->declared : first->second);
  return !meaning && is_new;
}

void bind_observables(Draft& draft) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::ObserveItem>(draft.scene->items)) {
    const bool fine = can_name_a_quantity(draft, item.name, seen);
    const auto value = quantity_of(draft, item.value, "the observable");
    if (fine && value) draft.problem.observables.push_back({item.name.name, *value, {range}});
  }
}

}  // namespace dpde::model
