// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/formula_symbols.h"

#include <algorithm>

#include "model/build.h"
#include "support/match.h"

namespace dpde::model {

namespace {

/// Parts written by the user have a position in the text; they are checked. The compiler's expansions of inject() and
/// of sample() next to walls have none. They are continuous by properties of the spacings that symbols do not express.
bool is_trusted(const Expr& e) { return !e->origin.range.is_known(); }

}  // namespace

std::optional<Expr> in_terms_of_problem(const Expr& e, const LocalFields& scope) {
  const Field* field = as<Field>(e);
  const auto local = field == nullptr ? scope.end() : scope.find(field->name);
  if (local != scope.end()) return local->second.value;
  bool is_known = true;
  const Expr result = map_children(e, [&](const Expr& part) {
    const std::optional<Expr> value = in_terms_of_problem(part, scope);
    is_known = is_known && value;
    return value.value_or(part);
  });
  return is_known ? std::optional(result) : std::nullopt;
}

const Expr* operand_of_switch(const Expr& e) {
  if (const Select* s = as<Select>(e)) return &s->condition;
  const Call* call = as<Call>(e);
  return call && has_jumps(call->fn) ? call->arguments.data() : nullptr;
}

const Expr* operand_of_pole(const Expr& e) {
  const Binary* binary = as<Binary>(e);
  if (binary && binary->op == BinaryOp::divide) return &binary->right;
  if (binary && binary->op == BinaryOp::power) return &binary->left;
  const Call* call = as<Call>(e);
  return call && has_poles(call->fn) ? call->arguments.data() : nullptr;
}

const Expr* operand_of_jump(const Expr& e) {
  const Expr* of_switch = operand_of_switch(e);
  return of_switch ? of_switch : operand_of_pole(e);
}

bool may_jump(const Expr& e) {
  return any_part(e, [](const Expr& part) {
    const Apply* apply = as<Apply>(part);
    if (apply != nullptr && std::ranges::any_of(apply->function.body, may_jump)) return true;
    const Expr* operand = operand_of_jump(part);
    return operand != nullptr && !is<Number>(*operand) && !is_trusted(part);
  });
}

bool FormulaSymbols::moves(const std::string& name) const {
  const auto local = scope_.find(name);
  return local != scope_.end() ? local->second.moves : movement_.moves(name);
}

bool FormulaSymbols::moves(const Expr& e) const {
  const auto is_place = [](const Expr& part) { return is<Coordinate>(part); };
  return std::ranges::any_of(names_read(e).any, [&](const std::string& name) { return moves(name); }) ||
         (movement_.places && any_part(e, is_place));
}

/// Equal expressions share one symbol.
Piecewise::Id FormulaSymbols::symbol(const Expr& e, const Offset& offset, const Piecewise::Symbol& symbol) {
  const std::pair<Expr, Offset> key{e, offset};
  const auto found = std::ranges::find(symbols_, key, &std::pair<std::pair<Expr, Offset>, Id>::first);
  if (found != symbols_.end()) return found->second;
  const Id id = formula_.symbol(symbol);
  symbols_.emplace_back(key, id);
  return id;
}

Piecewise::Id FormulaSymbols::param(const Expr& e, const std::string& name) {
  Piecewise::Symbol result = range_of(problem_, name);
  result.moves = moves(name);
  const Offset here;
  return symbol(e, here, result);
}

/// The symbol has the initial sign if the formulas tell it. The sign is unknown for values from files, for noise and
/// for an operator's arguments.
Piecewise::Id FormulaSymbols::field(const Expr& e, const std::string& name, const Offset& offset) {
  Piecewise::Symbol result{.moves = moves(name)};
  if (movement_.signs == Signs::any) return symbol(e, offset, result);
  const State* state = scope_.contains(name) ? nullptr : problem_.find_state(name);
  const Coefficient* coefficient = scope_.contains(name) ? nullptr : problem_.find_coefficient(name);
  const std::optional<Expr> given = state         ? state->initial.formula
                                    : coefficient ? coefficient->value.formula
                                                  : std::nullopt;
  const Movement nothing{[](const std::string&) { return false; }};
  if (given) result.sign = find_sign(FormulaSymbols(problem_, nothing, {*given, {}, ""}).formula());
  result.has_unknown_sign = !result.sign.has_value();
  return symbol(e, offset, result);
}

Piecewise::Id FormulaSymbols::coordinate(const Expr& e, int axis, const Offset& offset) {
  const Axis& along = problem_.axes[static_cast<std::size_t>(axis)];
  const auto [low, high] = std::minmax({along.face(0), along.face(along.cells)});
  return symbol(e, offset, {.moves = movement_.places, .low = low, .high = high});
}

Piecewise::Id FormulaSymbols::opaque(const Expr& e, const Offset& offset, const LocalFields& inside) {
  for_each_child(e, [&](const Expr& part) {
    if (may_jump(part)) inner_.push_back({part, inside, within_});
  });
  return symbol(e, offset, {.moves = moves(e)});
}

Piecewise::Id FormulaSymbols::shifted(const Shift& shift, Offset offset) {
  for (std::size_t a = 0; a < offset.size() && a < shift.offset.size(); ++a) offset[a] += shift.offset[a];
  return convert(shift.operand, offset);
}

Piecewise::Id FormulaSymbols::convert(const Expr& e, const Offset& offset) {
  const std::pair key{&e.node(), offset};
  const auto found = known_.find(key);
  if (found != known_.end()) return found->second;
  const Id id = convert_new(e, offset);
  if (operand_of_jump(e) && is_trusted(e)) formula_.trust(id);
  known_.emplace(key, id);
  sources_.emplace(id, e);
  return id;
}

Piecewise::Id FormulaSymbols::convert_new(const Expr& e, const Offset& offset) {
  const auto operand = [&](const Expr& part) { return convert(part, offset); };
  return match(
      e->kind, [&](const Number& n) { return formula_.number(n.value); },
      [&](const Param& p) { return param(e, p.name); }, [&](const Field& f) { return field(e, f.name, offset); },
      [&](const Coordinate& c) { return coordinate(e, c.axis, offset); },
      [&](const Noise&) { return symbol(e, offset, {}); },
      [&](const Neg& n) { return formula_.negate(operand(n.operand)); },
      [&](const Binary& b) {
        const Id left = operand(b.left);
        return formula_.binary(b.op, left, operand(b.right));
      },
      [&](const Call& c) {
        const Id first = operand(c.arguments.front());
        return formula_.call(c.fn, first,
                             c.arguments.size() > 1 ? std::optional(operand(c.arguments[1])) : std::nullopt);
      },
      [&](const Select& s) {
        const Id condition = operand(s.condition), yes = operand(s.yes);
        return formula_.choice(condition, yes, operand(s.no));
      },
      [&](const Shift& shift) { return shifted(shift, offset); },
      [&](const Derivative&) { return opaque(e, offset, scope_); },
      [&](const Advect&) { return opaque(e, offset, scope_); },
      [&](const Interpolate&) { return opaque(e, offset, scope_); },
      [&](const BandPass&) { return opaque(e, offset, scope_); },
      [&](const Sample&) { return opaque(e, offset, scope_); },
      [&](const Reduce&) { return opaque(e, offset, scope_); },
      [&](const Apply& a) {
        LocalFields inside;
        for (std::size_t i = 0; i < a.arguments.size(); ++i)
          inside[a.function.parameters[i]] = {moves(a.arguments[i]), in_terms_of_problem(a.arguments[i], scope_)};
        for (const Expr& part : a.function.body) {
          if (may_jump(part)) inner_.push_back({part, inside, a.function.name});
        }
        return opaque(e, offset, scope_);
      },
      [&](const NetworkCall&) { return opaque(e, offset, scope_); },
      [&](const Solve& s) {
        LocalFields inside = scope_;
        const auto follows = [&](const Expr& start) { return s.iterations && moves(start); };
        inside[s.name] = {moves(s.right) || moves(s.operation) || std::ranges::any_of(s.starts, follows) ||
                          (s.preconditioner && follows(*s.preconditioner))};
        return opaque(without_aids(s, e->origin), offset, inside);
      });
}

}  // namespace dpde::model
