// SPDX-License-Identifier: Apache-2.0
#include "model/switches.h"

#include <algorithm>
#include <map>
#include <utility>

#include "model/build.h"
#include "support/match.h"
#include "support/piecewise.h"

namespace dpde::model {

namespace {

/// Whether fields that no name of the problem is, as an operator's parameters, move.
using Scope = std::map<std::string, bool>;

/// What a switch hangs on: a condition, or what sign, floor and fraction are of.
const Expr* operand_of_switch(const Expr& e) {
  if (const Select* s = std::get_if<Select>(&e->kind)) return &s->condition;
  const Call* call = std::get_if<Call>(&e->kind);
  const bool has_cases = call && (call->fn == Fn::sign || call->fn == Fn::floor || call->fn == Fn::fraction);
  return has_cases ? call->arguments.data() : nullptr;
}

/// What a person wrote has a place in the text. What the compiler makes of inject() and sample() beside walls has none:
/// it is continuous, by spacings that symbols know nothing of.
/// floor is refused where it is differentiated (E0601), and by what it hangs on.
bool is_trusted(const Expr& e) {
  const Call* call = std::get_if<Call>(&e->kind);
  return !e->origin.range.is_known() || (call != nullptr && call->fn == Fn::floor);
}

bool has_switch(const Expr& e) {
  return any_part(e, [](const Expr& part) { return operand_of_switch(part) != nullptr && !is_trusted(part); });
}

/// A formula as one of independent symbols. What is no arithmetic, as a derivative, is a symbol, and what stands inside
/// is a formula of its own.
class Converter {
 public:
  struct Inner {
    Expr value;
    Scope scope;
  };

  Converter(const Problem& problem, const Influence& influence, Scope scope)
      : problem_(problem), influence_(influence), scope_(std::move(scope)) {}

  void convert(const Expr& e) { convert(e, std::vector<int>(problem_.axes.size(), 0)); }
  const Piecewise& formula() const { return formula_; }
  const Expr& source_of(Piecewise::Id id) const { return sources_.at(id); }
  const std::vector<Inner>& inner() const { return inner_; }

 private:
  using Id = Piecewise::Id;
  using Offset = std::vector<int>;
  Id convert(const Expr& e, const Offset& offset);
  Id convert_new(const Expr& e, const Offset& offset);
  Id symbol(const Expr& e, const Offset& offset, const Piecewise::Symbol& symbol);
  Id param(const Expr& e, const std::string& name);
  Id coordinate(const Expr& e, int axis, const Offset& offset);
  Id opaque(const Expr& e, const Offset& offset, const Scope& inside);
  Id shifted(const Shift& shift, Offset offset);
  bool moves(const Expr& e) const;
  bool moves(const std::string& name) const;

  const Problem& problem_;
  const Influence& influence_;
  Scope scope_;
  Piecewise formula_;
  std::map<std::pair<const Node*, Offset>, Id> known_;
  std::map<Id, Expr> sources_;
  std::vector<std::pair<std::pair<Expr, Offset>, Id>> symbols_;
  std::vector<Inner> inner_;
};

bool Converter::moves(const std::string& name) const {
  const auto local = scope_.find(name);
  return local != scope_.end() ? local->second : !influence_.on(name).any.empty();
}

bool Converter::moves(const Expr& e) const {
  return std::ranges::any_of(reading_of(e).any, [&](const std::string& name) { return moves(name); });
}

/// One symbol for all that is equal.
Piecewise::Id Converter::symbol(const Expr& e, const Offset& offset, const Piecewise::Symbol& symbol) {
  const std::pair<Expr, Offset> key{e, offset};
  const auto found = std::ranges::find(symbols_, key, &std::pair<std::pair<Expr, Offset>, Id>::first);
  if (found != symbols_.end()) return found->second;
  const Id id = formula_.symbol(symbol);
  symbols_.emplace_back(key, id);
  return id;
}

Piecewise::Id Converter::param(const Expr& e, const std::string& name) {
  Piecewise::Symbol result{.moves = moves(name)};
  const Offset here;
  if (name == "t") {
    result.low = problem_.t_begin;
    result.high = problem_.t_begin + problem_.steps * problem_.step;
  } else if (name == "dt") {
    result.value = problem_.step;
  } else if (const Parameter* known = problem_.find_param(name); known && !problem_.find_control(name)) {
    result.value = known->value;
    const auto& unknowns = problem_.task->unknowns;
    const auto sought = std::ranges::find_if(unknowns, [&](const Unknown& unknown) {
      return unknown.kind == Unknown::Kind::parameter && unknown.name == name && unknown.is_bounded();
    });
    if (sought != unknowns.end()) {
      result.low = sought->low;
      result.high = sought->high;
    } else if (known->value > 0) {  // as a length or a rate: formulas are written for its sign
      result.low = 0;
    } else if (known->value < 0) {
      result.high = 0;
    }
  }
  return symbol(e, here, result);
}

Piecewise::Id Converter::coordinate(const Expr& e, int axis, const Offset& offset) {
  const Axis& along = problem_.axes[static_cast<std::size_t>(axis)];
  const auto [low, high] = std::minmax({along.face(0), along.face(along.cells)});
  return symbol(e, offset, {.low = low, .high = high});
}

Piecewise::Id Converter::opaque(const Expr& e, const Offset& offset, const Scope& inside) {
  for_each_part(e, [&](const Expr& part) {
    if (has_switch(part)) inner_.push_back({part, inside});
  });
  return symbol(e, offset, {.moves = moves(e)});
}

Piecewise::Id Converter::shifted(const Shift& shift, Offset offset) {
  for (std::size_t a = 0; a < offset.size() && a < shift.offset.size(); ++a) offset[a] += shift.offset[a];
  return convert(shift.operand, offset);
}

Piecewise::Id Converter::convert(const Expr& e, const Offset& offset) {
  const std::pair key{&e.node(), offset};
  const auto found = known_.find(key);
  if (found != known_.end()) return found->second;
  const Id id = convert_new(e, offset);
  if (operand_of_switch(e) && is_trusted(e)) formula_.trust(id);
  known_.emplace(key, id);
  sources_.emplace(id, e);
  return id;
}

Piecewise::Id Converter::convert_new(const Expr& e, const Offset& offset) {
  const auto operand = [&](const Expr& part) { return convert(part, offset); };
  return match(
      e->kind, [&](const Number& n) { return formula_.number(n.value); },
      [&](const Param& p) { return param(e, p.name); },
      [&](const Field& field) { return symbol(e, offset, {.moves = moves(field.name)}); },
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
      [&](const Sample&) { return opaque(e, offset, scope_); },
      [&](const Reduce&) { return opaque(e, offset, scope_); },
      [&](const Apply& a) {
        Scope inside;
        for (std::size_t i = 0; i < a.arguments.size(); ++i) inside[a.function.parameters[i]] = moves(a.arguments[i]);
        for (const Expr& part : a.function.body) {
          if (has_switch(part)) inner_.push_back({part, inside});
        }
        return opaque(e, offset, scope_);
      },
      [&](const NetworkCall&) { return opaque(e, offset, scope_); },
      [&](const Solve& s) {
        Scope inside = scope_;
        inside[s.name] = moves(s.right) || moves(s.operation);
        return opaque(e, offset, inside);
      });
}

Jump jump_at(const Expr& e, const Influence& influence) {
  Jump jump{e->origin, "", {}};
  if (const Call* call = std::get_if<Call>(&e->kind)) jump.what = name_of(call->fn);
  for (const std::string& name : reading_of(*operand_of_switch(e)).any) {
    if (!influence.on(name).any.empty()) jump.movers.push_back(name);
  }
  return jump;
}

std::optional<Jump> jump_in(const Expr& formula, const Problem& problem, const Influence& influence) {
  std::vector<Converter::Inner> waiting{{formula, {}}};
  while (!waiting.empty()) {
    const Converter::Inner next = waiting.back();
    waiting.pop_back();
    if (!has_switch(next.value)) continue;
    Converter converter(problem, influence, next.scope);
    converter.convert(next.value);
    if (const std::optional<Piecewise::Id> jump = find_jump(converter.formula()))
      return jump_at(converter.source_of(*jump), influence);
    waiting.insert(waiting.end(), converter.inner().begin(), converter.inner().end());
  }
  return std::nullopt;
}

bool is_mask(const Problem& problem, const std::string& name) {
  const Coefficient* coefficient = problem.find_coefficient(name);
  return coefficient != nullptr && coefficient->is_mask;
}

/// Of a switch in the formulas of a run that the unknown moves.
Origin switch_moved_by(std::size_t unknown, const Problem& problem, const Influence& influence) {
  std::optional<Origin> found;
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (found || (!formula.is_of_loss && !influence.reaches_losses(formula.makes))) return;
    any_part(*formula.value, [&](const Expr& part) {
      const Expr* operand = operand_of_switch(part);
      if (!found && operand && influence.on(reading_of(*operand)).any.contains(unknown)) found = part->origin;
      return found.has_value();
    });
  });
  return found.value_or(Origin{});
}

}  // namespace

std::vector<OnlySwitching> only_switching(const Problem& problem, const Influence& influence) {
  std::vector<OnlySwitching> result;
  for (const std::size_t unknown : influence.on_losses().any) {
    if (influence.on_losses().smooth.contains(unknown)) continue;
    const Origin origin = switch_moved_by(unknown, problem, influence);
    const bool sets_length = problem.rate && influence.on(reading_of(*problem.rate)).any.contains(unknown);
    result.push_back({unknown, origin, sets_length && !origin.range.is_known()});
  }
  return result;
}

std::vector<Jump> jumps_of(const Problem& problem, const Influence& influence) {
  std::vector<Jump> jumps;
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (formula.is_of_length || is_mask(problem, formula.makes)) return;
    if (!formula.is_of_loss && !influence.reaches_losses(formula.makes)) return;
    if (std::optional<Jump> jump = jump_in(*formula.value, problem, influence)) jumps.push_back(std::move(*jump));
  });
  return jumps;
}

}  // namespace dpde::model
