// SPDX-License-Identifier: Apache-2.0
// Numbers computed from a state: losses, observables, tests. Linear combinations of mean, sum and integral over the
// grid stay as they are, since one sweep computes them. Any other number, (integral(u) - d)^2, becomes the mean of
// itself.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

bool is_sum(const Binary& b) { return b.op == BinaryOp::add || b.op == BinaryOp::subtract; }

/// a*mean(u), mean(u)/a: the factor contains no reduction.
const Expr* scaled_reduction(const Binary& b) {
  const bool in_left = holds_any<Reduce>(b.left), in_right = holds_any<Reduce>(b.right);
  if (b.op == BinaryOp::multiply && in_right && is_uniform(b.left)) return &b.right;
  const bool is_product = b.op == BinaryOp::multiply || b.op == BinaryOp::divide;
  return is_product && in_left && is_uniform(b.right) ? &b.left : nullptr;
}

/// The part of `e` outside all reductions that varies in space; nullptr if `e` is a number. Data outside reductions are
/// one number per state, if possible.
const Expr* varying_part(const Elaboration& elaboration, const Expr& e) {
  if (const auto* reduce = as<Reduce>(e)) return reduce->is_over_all() ? nullptr : &e;
  if (const auto* field = as<Field>(e)) return can_be_series(elaboration, field->name) ? nullptr : &e;
  if (is_uniform(e)) return nullptr;
  const Expr* found = nullptr;
  bool has_parts = false;
  for_each_child(e, [&](const Expr& part) {
    has_parts = true;
    if (found == nullptr) found = varying_part(elaboration, part);
  });
  const bool is_made_of_parts = is<Neg, Binary, Call, Select>(e);
  return has_parts && is_made_of_parts ? found : &e;
}

/// The suggested formula.
std::string reduced(const Elaboration& elaboration, const Expr& varying) {
  const auto* field = as<Field>(varying);
  if (field != nullptr && elaboration.problem.task) {
    const auto datum = std::ranges::find(elaboration.problem.task->data, field->name, &Datum::name);
    if (datum != elaboration.problem.task->data.end() && !datum->scene.empty())
      return fmt::format(
          "write mean((u - {0})^2) or another mean, or let {0} be a number: observe seen = mean({1}) in "
          "scene {2}, and here data {0} = seen from scene {2}",
          datum->name, datum->field, datum->scene);
  }
  return "write mean(u^2), sum, integral, max or min of what varies in space, as in mean((u - v)^2)";
}

/// Marks the data outside of reductions as series.
void mark_series(Elaboration& elaboration, const Expr& e) {
  if (is<Reduce>(e)) return;
  if (const auto* field = as<Field>(e)) mark_as_series(elaboration, field->name);
  for_each_child(e, [&](const Expr& part) { mark_series(elaboration, part); });
}

/// A number as a sum of reductions with factors. A max or min over the grid becomes the mean of itself, too.
Expr as_reductions(const Expr& e) {
  if (const auto* reduce = as<Reduce>(e)) {
    const bool is_extreme = reduce->reduction == Reduce::Kind::max || reduce->reduction == Reduce::Kind::min;
    return is_extreme ? model::reduce(Reduce::Kind::mean, e, e->origin) : e;
  }
  if (is_uniform(e)) return e;
  if (const auto* neg = as<Neg>(e)) return negate(as_reductions(neg->operand), e->origin);
  if (const auto* b = as<Binary>(e)) {
    const Expr* scaled = scaled_reduction(*b);
    const auto side = [&](const Expr& part) { return is_sum(*b) || &part == scaled ? as_reductions(part) : part; };
    if (is_sum(*b) || scaled) return binary(b->op, side(b->left), side(b->right), e->origin);
  }
  return model::reduce(Reduce::Kind::mean, e, e->origin);
}

/// A term for which it is undefined whether values at several times are added or averaged, as it is no mean, sum or
/// integral; nullptr if there is none.
const Expr* uncounted_part(const Expr& e) {
  if (const auto* reduce = as<Reduce>(e)) {
    const bool is_extreme = reduce->reduction == Reduce::Kind::max || reduce->reduction == Reduce::Kind::min;
    return is_extreme ? &e : nullptr;
  }
  if (const auto* neg = as<Neg>(e)) return uncounted_part(neg->operand);
  const auto* b = as<Binary>(e);
  if (b == nullptr || !holds_any<Reduce>(e)) return &e;
  if (const Expr* scaled = scaled_reduction(*b)) return uncounted_part(*scaled);
  if (!is_sum(*b)) return &e;
  const Expr* left = uncounted_part(b->left);
  return left != nullptr ? left : uncounted_part(b->right);
}

/// False after a diagnostic.
bool is_counted(Elaboration& elaboration, const Expr& value, const When& when, SourceRange whole) {
  const bool is_of_many = when.kind == When::Kind::over || (when.kind == When::Kind::steps && !when.is_last);
  const Expr* term = is_of_many && !when.counted ? uncounted_part(value) : nullptr;
  if (term == nullptr) return true;
  const SourceRange range = (*term)->origin.range;
  const std::string over = when.kind == When::Kind::over ? "time" : fmt::format("{} steps", when.count);
  elaboration.sink.report("not-counted", range.is_known() ? range : whole, {"over " + over},
                          fmt::format("write , mean over {0} or , sum over {0}, which hold for the whole line", over));
  return false;
}

}  // namespace

std::optional<Expr> quantity_of(Elaboration& elaboration, const ast::Expr& e, const std::string& what,
                                const When& when) {
  const auto value = formulas::number({elaboration, FormulaContext::quantity, what}, e);
  const bool counts_once = elaboration.averages.are_taken && !elaboration.averages.of_loss.empty();
  if (!value || (!counts_once && !is_counted(elaboration, *value, when, e.range()))) return std::nullopt;
  return quantity_of(elaboration, *value, what, e.range());
}

std::optional<Expr> quantity_of(Elaboration& elaboration, const Expr& value, const std::string& what,
                                SourceRange whole) {
  const Expr number = over_one_cell(elaboration, value);
  const Expr* mistake =
      elaboration.problem.has_grid ? varying_part(elaboration, number) : nullptr;  // one cell: a number
  if (mistake != nullptr) {
    const SourceRange range = (*mistake)->origin.range;
    elaboration.sink.report("not-reduced", range.is_known() ? range : whole, {what}, reduced(elaboration, *mistake));
    return std::nullopt;
  }
  mark_series(elaboration, number);
  return as_reductions(number);
}

bool can_name_a_quantity(Elaboration& elaboration, const ast::Identifier& name,
                         std::map<std::string, SourceRange>& seen) {
  if (is_reserved(name.name)) {
    elaboration.sink.report("reserved-name", name.range, {name.name, "number"}, "choose another name");
    return false;
  }
  const Symbol* meaning = elaboration.names.scope.find(name.name);
  const auto [first, is_new] = seen.emplace(name.name, name.range);
  if (meaning || !is_new)
    report_duplicate(elaboration, name.name, name.range, meaning ? meaning->declared : first->second);
  return !meaning && is_new;
}

void bind_observables(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen;
  for (const auto& [item, range] : items_of<ast::ObserveItem>(elaboration.blocks.scene->items)) {
    const bool fine = can_name_a_quantity(elaboration, item.name, seen);
    const auto value = quantity_of(elaboration, item.value, "the observable");
    if (fine && value) elaboration.problem.observables.push_back({item.name.name, *value, {range}});
  }
}

}  // namespace dpde::model
