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

/// Fields that no name of the problem is, as an operator's parameters: whether they move, and what they are in terms of
/// the problem, where that is known.
struct Local {
  bool moves = false;
  std::optional<Expr> value = {};
};
using Scope = std::map<std::string, Local>;

/// nullopt where it is made of what is not known.
std::optional<Expr> in_terms_of_problem(const Expr& e, const Scope& scope) {
  const Field* field = std::get_if<Field>(&e->kind);
  const auto local = field == nullptr ? scope.end() : scope.find(field->name);
  if (local != scope.end()) return local->second.value;
  bool is_known = true;
  const Expr result = map_parts(e, [&](const Expr& part) {
    const std::optional<Expr> value = in_terms_of_problem(part, scope);
    is_known = is_known && value;
    return value.value_or(part);
  });
  return is_known ? std::optional(result) : std::nullopt;
}

/// What a switch hangs on: a condition, or what sign, floor and fraction are of.
const Expr* operand_of_switch(const Expr& e) {
  if (const Select* s = std::get_if<Select>(&e->kind)) return &s->condition;
  const Call* call = std::get_if<Call>(&e->kind);
  const bool has_cases = call && (call->fn == Fn::sign || call->fn == Fn::floor || call->fn == Fn::fraction);
  return has_cases ? call->arguments.data() : nullptr;
}

/// What is 0 where there is a pole: a divisor, what a power is of, or stands in a logarithm or a tangent.
const Expr* operand_of_pole(const Expr& e) {
  const Binary* binary = std::get_if<Binary>(&e->kind);
  if (binary && binary->op == BinaryOp::divide) return &binary->right;
  if (binary && binary->op == BinaryOp::power) return &binary->left;
  const Call* call = std::get_if<Call>(&e->kind);
  return call && (call->fn == Fn::log || call->fn == Fn::tan) ? call->arguments.data() : nullptr;
}

const Expr* operand_of_jump(const Expr& e) {
  const Expr* of_switch = operand_of_switch(e);
  return of_switch ? of_switch : operand_of_pole(e);
}

/// What a person wrote has a place in the text. What the compiler makes of inject() and sample() beside walls has none:
/// it is continuous, by spacings that symbols know nothing of.
bool is_trusted(const Expr& e) { return !e->origin.range.is_known(); }

/// The function that switches; "" for if.
std::string switching_function(const Expr& e) {
  const Call* call = std::get_if<Call>(&e->kind);
  return call ? std::string(name_of(call->fn)) : "";
}

/// In the bodies of operators, too. What is divided by a number has no pole.
bool may_jump(const Expr& e) {
  return any_part(e, [](const Expr& part) {
    const Apply* apply = std::get_if<Apply>(&part->kind);
    if (apply != nullptr && std::ranges::any_of(apply->function.body, may_jump)) return true;
    const Expr* operand = operand_of_jump(part);
    return operand != nullptr && !std::holds_alternative<Number>((*operand)->kind) && !is_trusted(part);
  });
}

/// A formula as one of independent symbols. What is no arithmetic, as a derivative, is a symbol, and what stands inside
/// is a formula of its own.
class Converter {
 public:
  struct Inner {
    Expr value;
    Scope scope;
    std::string within;
  };

  Converter(const Problem& problem, const Movement& movement, Inner whole)
      : problem_(problem), movement_(movement), scope_(std::move(whole.scope)), within_(std::move(whole.within)) {
    convert(whole.value);
  }

  const Piecewise& formula() const { return formula_; }
  const Expr& source_of(Piecewise::Id id) const { return sources_.at(id); }
  void trust(Piecewise::Id id) { formula_.trust(id); }
  const std::vector<Inner>& inner() const { return inner_; }

 private:
  using Id = Piecewise::Id;
  using Offset = std::vector<int>;
  void convert(const Expr& e) { convert(e, Offset(problem_.axes.size(), 0)); }
  Id convert(const Expr& e, const Offset& offset);
  Id convert_new(const Expr& e, const Offset& offset);
  Id symbol(const Expr& e, const Offset& offset, const Piecewise::Symbol& symbol);
  Id param(const Expr& e, const std::string& name);
  Id field(const Expr& e, const std::string& name, const Offset& offset);
  Id coordinate(const Expr& e, int axis, const Offset& offset);
  Id opaque(const Expr& e, const Offset& offset, const Scope& inside);
  Id shifted(const Shift& shift, Offset offset);
  bool moves(const Expr& e) const;
  bool moves(const std::string& name) const;

  const Problem& problem_;
  const Movement& movement_;
  Scope scope_;
  std::string within_;
  Piecewise formula_;
  std::map<std::pair<const Node*, Offset>, Id> known_;
  std::map<Id, Expr> sources_;
  std::vector<std::pair<std::pair<Expr, Offset>, Id>> symbols_;
  std::vector<Inner> inner_;
};

bool Converter::moves(const std::string& name) const {
  const auto local = scope_.find(name);
  return local != scope_.end() ? local->second.moves : movement_.moves(name);
}

bool Converter::moves(const Expr& e) const {
  const auto is_place = [](const Expr& part) { return std::holds_alternative<Coordinate>(part->kind); };
  return std::ranges::any_of(reading_of(e).any, [&](const std::string& name) { return moves(name); }) ||
         (movement_.places && any_part(e, is_place));
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
  Piecewise::Symbol result = range_of(problem_, name);
  result.moves = moves(name);
  const Offset here;
  return symbol(e, here, result);
}

/// With the sign that it has at first, where the text tells it. Values from files and noise have one that it does not,
/// and what an operator is called with.
Piecewise::Id Converter::field(const Expr& e, const std::string& name, const Offset& offset) {
  Piecewise::Symbol result{.moves = moves(name)};
  if (movement_.signs == Signs::any) return symbol(e, offset, result);
  const State* state = scope_.contains(name) ? nullptr : problem_.find_state(name);
  const Coefficient* coefficient = scope_.contains(name) ? nullptr : problem_.find_coefficient(name);
  const std::optional<Expr> given = state         ? state->initial.formula
                                    : coefficient ? coefficient->value.formula
                                                  : std::nullopt;
  const Movement nothing{[](const std::string&) { return false; }};
  if (given) result.sign = find_sign(Converter(problem_, nothing, {*given, {}, ""}).formula());
  result.has_unknown_sign = !result.sign.has_value();
  return symbol(e, offset, result);
}

Piecewise::Id Converter::coordinate(const Expr& e, int axis, const Offset& offset) {
  const Axis& along = problem_.axes[static_cast<std::size_t>(axis)];
  const auto [low, high] = std::minmax({along.face(0), along.face(along.cells)});
  return symbol(e, offset, {.moves = movement_.places, .low = low, .high = high});
}

Piecewise::Id Converter::opaque(const Expr& e, const Offset& offset, const Scope& inside) {
  for_each_part(e, [&](const Expr& part) {
    if (may_jump(part)) inner_.push_back({part, inside, within_});
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
  if (operand_of_jump(e) && is_trusted(e)) formula_.trust(id);
  known_.emplace(key, id);
  sources_.emplace(id, e);
  return id;
}

Piecewise::Id Converter::convert_new(const Expr& e, const Offset& offset) {
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
      [&](const Sample&) { return opaque(e, offset, scope_); },
      [&](const Reduce&) { return opaque(e, offset, scope_); },
      [&](const Apply& a) {
        Scope inside;
        for (std::size_t i = 0; i < a.arguments.size(); ++i)
          inside[a.function.parameters[i]] = {moves(a.arguments[i]), in_terms_of_problem(a.arguments[i], scope_)};
        for (const Expr& part : a.function.body) {
          if (may_jump(part)) inner_.push_back({part, inside, a.function.name});
        }
        return opaque(e, offset, scope_);
      },
      [&](const NetworkCall&) { return opaque(e, offset, scope_); },
      [&](const Solve& s) {
        Scope inside = scope_;
        inside[s.name] = {moves(s.right) || moves(s.operation)};
        return opaque(without_starts(s, e->origin), offset, inside);
      });
}

bool is_mask(const Problem& problem, const std::string& name) {
  const Coefficient* coefficient = problem.find_coefficient(name);
  return coefficient != nullptr && coefficient->is_mask;
}

/// Of a switch in the formulas of a run that the unknown moves.
std::optional<Expr> switch_moved_by(std::size_t unknown, const Problem& problem, const Influence& influence) {
  std::optional<Expr> found;
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (found || (!formula.is_of_loss && !influence.reaches_losses(formula.makes))) return;
    any_part(*formula.value, [&](const Expr& part) {
      const Expr* operand = operand_of_switch(part);
      if (!found && operand && influence.on(reading_of(*operand)).any.contains(unknown)) found = part;
      return found.has_value();
    });
  });
  return found;
}

const Unknown* bounded_unknown(const Problem& problem, const std::string& param) {
  if (!problem.task) return nullptr;
  const auto& unknowns = problem.task->unknowns;
  const auto sought = std::ranges::find_if(unknowns, [&](const Unknown& unknown) {
    return unknown.kind == Unknown::Kind::parameter && unknown.name == param && unknown.is_bounded();
  });
  return sought == unknowns.end() ? nullptr : &*sought;
}

}  // namespace

Piecewise::Symbol range_of(const Problem& problem, const std::string& param) {
  Piecewise::Symbol result;
  if (param == "t") {
    result.low = problem.t_begin;
    result.high = problem.t_begin + problem.steps * problem.step;
  } else if (param == "dt") {
    result.value = problem.step;
  } else if (const Parameter* known = problem.find_param(param); known && !problem.find_control(param)) {
    result.value = known->value;
    const Unknown* sought = bounded_unknown(problem, param);
    result.may_leave = sought == nullptr;
    if (sought != nullptr) {
      result.low = sought->low;
      result.high = sought->high;
    } else if (known->value > 0) {
      result.low = 0;
    } else if (known->value < 0) {
      result.high = 0;
    }
  }
  return result;
}

std::vector<OnlySwitching> only_switching(const Problem& problem, const Influence& influence) {
  std::vector<OnlySwitching> result;
  for (const std::size_t unknown : influence.on_losses().any) {
    if (influence.on_losses().smooth.contains(unknown)) continue;
    const std::optional<Expr> found = switch_moved_by(unknown, problem, influence);
    const Origin origin = found ? (*found)->origin : Origin{};
    const bool sets_length = problem.rate && influence.on(reading_of(*problem.rate)).any.contains(unknown);
    result.push_back(
        {unknown, origin, found ? switching_function(*found) : "", sets_length && !origin.range.is_known()});
  }
  return result;
}

namespace {

/// The formula, and those that stand inside of what is no arithmetic, one after the other until `look` is true of one.
void look_inside(const Expr& formula, const Problem& problem, const Movement& movement,
                 const std::function<bool(Converter&, const Converter::Inner&)>& look) {
  std::vector<Converter::Inner> waiting{{formula, {}, ""}};
  while (!waiting.empty()) {
    const Converter::Inner next = waiting.back();
    waiting.pop_back();
    if (!may_jump(next.value)) continue;
    Converter converter(problem, movement, next);
    if (look(converter, next)) return;
    waiting.insert(waiting.end(), converter.inner().begin(), converter.inner().end());
  }
}

/// What changes its sign where `e` is 0: (p*q)^2 is 0 where p or q is.
void add_factors(const Expr& e, std::vector<Expr>& factors) {
  const Neg* neg = std::get_if<Neg>(&e->kind);
  if (neg != nullptr) return add_factors(neg->operand, factors);
  const Binary* binary = std::get_if<Binary>(&e->kind);
  const bool is_product = binary && (binary->op == BinaryOp::multiply || binary->op == BinaryOp::divide);
  if (is_product || (binary && binary->op == BinaryOp::power)) add_factors(binary->left, factors);
  if (is_product) add_factors(binary->right, factors);
  if (binary && (is_product || binary->op == BinaryOp::power)) return;
  const Call* call = std::get_if<Call>(&e->kind);
  if (call && (call->fn == Fn::abs || call->fn == Fn::sqrt)) return add_factors(call->arguments.front(), factors);
  if (!std::holds_alternative<Number>(e->kind)) factors.push_back(e);
}

std::vector<Expr> factors_of_divisor(const Expr& pole) {
  const Call* call = std::get_if<Call>(&pole->kind);
  const Expr& operand = *operand_of_pole(pole);
  std::vector<Expr> factors;
  add_factors(call && call->fn == Fn::tan ? model::call(Fn::cos, {operand}) : operand, factors);
  return factors;
}

/// With the formulas of states, where they begin, and of coefficients; nullopt where one has none.
std::optional<Expr> at_the_start(const Expr& e, const Problem& problem) {
  if (const Field* field = std::get_if<Field>(&e->kind)) {
    const State* state = problem.find_state(field->name);
    const Coefficient* coefficient = problem.find_coefficient(field->name);
    return state ? state->initial.formula : coefficient ? coefficient->value.formula : std::nullopt;
  }
  bool is_known = true;
  const Expr result = map_parts(e, [&](const Expr& part) {
    const std::optional<Expr> value = at_the_start(part, problem);
    is_known = is_known && value;
    return value.value_or(part);
  });
  return is_known ? std::optional(result) : std::nullopt;
}

/// nullopt where formulas do not tell it, 0 where it has both.
std::optional<double> sign_at_the_start(const Expr& e, const Problem& problem) {
  const std::optional<Expr> start = at_the_start(e, problem);
  const Movement nothing{[](const std::string&) { return false; }};
  return start ? find_sign(Converter(problem, nothing, {*start, {}, ""}).formula()) : std::nullopt;
}

/// Whether an unknown moves the places where `e` is 0 at first, or is what it is made of.
bool moves_its_start(const Expr& e, const Problem& problem, const Influence& influence) {
  const auto is_sought = [&](const std::string& name) {
    return std::ranges::any_of(problem.task->unknowns,
                               [&](const Unknown& unknown) { return unknown.is_field() && unknown.name == name; });
  };
  const auto is_moved = [&](const std::string& name) {
    return problem.find_state(name) == nullptr && !influence.on(name).any.empty();
  };
  std::vector<Expr> factors;
  add_factors(at_the_start(e, problem).value_or(e), factors);
  return std::ranges::any_of(reading_of(e).any, is_sought) || std::ranges::any_of(factors, [&](const Expr& factor) {
           return std::ranges::any_of(reading_of(factor).any, is_moved) &&
                  sign_at_the_start(factor, problem).value_or(0) == 0;
         });
}

std::optional<Expr> side_of(const Expr& e, const Scope& scope, const Problem& problem) {
  const Select* select = std::get_if<Select>(&e->kind);
  const Call* call = std::get_if<Call>(&e->kind);
  std::optional<Expr> side;
  if (select != nullptr) {
    const std::optional<Expr> condition = in_terms_of_problem(select->condition, scope);
    if (condition) side = model::select(*condition, number(1), number(-1), e->origin);
  } else if (call != nullptr && call->fn == Fn::sign) {
    side = in_terms_of_problem(call->arguments.front(), scope);
  }
  const std::optional<double> sign = side ? sign_at_the_start(*side, problem) : std::nullopt;
  return sign && *sign == 0 ? std::nullopt : side;
}

Jump jump_of(const Expr& e, const Converter::Inner& in, const Problem& problem, const Movement& movement) {
  Jump jump{e->origin, switching_function(e), {}, in.within, operand_of_switch(e) == nullptr};
  jump.side = side_of(e, in.scope, problem);
  for (const std::string& name : reading_of(*operand_of_jump(e)).any) {
    if (movement.moves(name)) jump.movers.push_back(name);
  }
  return jump;
}

using LossNumber = std::optional<std::size_t>;

/// One after the other, each as if those before met.
void add_jumps(const Expr& formula, LossNumber loss, const Problem& problem, const Movement& movement,
               std::vector<Jump>& jumps) {
  look_inside(formula, problem, movement, [&](Converter& converter, const Converter::Inner& next) {
    while (const std::optional<Piecewise::Id> found = find_jump(converter.formula())) {
      jumps.push_back(jump_of(converter.source_of(*found), next, problem, movement));
      jumps.back().loss = loss;
      converter.trust(*found);
      if (!jumps.back().side) break;  // it is refused
    }
    return false;
  });
}

}  // namespace

std::optional<Jump> jump_in(const Expr& formula, const Problem& problem, const Movement& movement) {
  std::optional<Jump> jump;
  look_inside(formula, problem, movement, [&](const Converter& converter, const Converter::Inner& next) {
    const std::optional<Piecewise::Id> found = find_jump(converter.formula());
    if (found) jump = jump_of(converter.source_of(*found), next, problem, movement);
    return found.has_value();
  });
  return jump;
}

namespace {

Movement movement_of(const Influence& influence, Signs signs) {
  return {[&](const std::string& name) { return !influence.on(name).any.empty(); }, false, signs};
}

/// All divisors at whose zeros the formula jumps, whatever the signs of fields. Zeros that nothing moves are left out.
void add_divisors(const Expr& formula, LossNumber loss, const Problem& problem, const Influence& influence,
                  std::vector<Divisor>& divisors) {
  const Movement movement = movement_of(influence, Signs::any);
  const auto is_still = [&](const Expr& value) { return std::ranges::none_of(reading_of(value).any, movement.moves); };
  look_inside(formula, problem, movement, [&](Converter& converter, const Converter::Inner& next) {
    while (const std::optional<Piecewise::Id> found = find_jump(converter.formula())) {
      const Expr& pole = converter.source_of(*found);
      converter.trust(*found);
      if (operand_of_switch(pole) != nullptr) continue;
      for (const Expr& factor : factors_of_divisor(pole)) {
        const std::optional<Expr> value = in_terms_of_problem(factor, next.scope);
        if (value && is_still(*value)) continue;
        const bool is_one_sign = value && (sign_at_the_start(*value, problem).value_or(0) != 0 ||
                                           moves_its_start(*value, problem, influence));
        divisors.push_back({value, pole->origin, is_one_sign, loss});
      }
    }
    return false;
  });
}

/// Of the formulas that the losses hang on, with the number of the loss that it is. Those of masks are left out, as no
/// unknown may stand in them.
void for_each_judged_formula(const Problem& problem, const Influence& influence,
                             const std::function<void(const Expr&, LossNumber)>& f) {
  const std::vector<Loss>& losses = problem.task->losses;
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (formula.is_of_length || is_mask(problem, formula.makes)) return;
    const auto loss = std::ranges::find_if(losses, [&](const Loss& one) { return &one.value == formula.value; });
    const LossNumber number = loss == losses.end() ? LossNumber() : static_cast<std::size_t>(loss - losses.begin());
    if (formula.is_of_loss || influence.reaches_losses(formula.makes)) f(*formula.value, number);
  });
}

}  // namespace

std::vector<Jump> jumps_of(const Problem& problem, const Influence& influence, Signs signs) {
  const Movement movement = movement_of(influence, signs);
  std::vector<Jump> jumps;
  for_each_judged_formula(problem, influence, [&](const Expr& formula, LossNumber loss) {
    add_jumps(formula, loss, problem, movement, jumps);
  });
  return jumps;
}

std::vector<Divisor> trusted_divisors(const Problem& problem, const Influence& influence) {
  const Movement kept = movement_of(influence, Signs::kept);
  std::vector<Divisor> divisors;
  for_each_judged_formula(problem, influence, [&](const Expr& formula, LossNumber loss) {
    if (!jump_in(formula, problem, kept)) add_divisors(formula, loss, problem, influence, divisors);
  });
  return divisors;
}

}  // namespace dpde::model
