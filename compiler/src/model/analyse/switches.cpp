// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/switches.h"

#include <algorithm>

#include "model/analyse/formula_symbols.h"
#include "model/build.h"
#include "support/maths/piecewise.h"

namespace dpde::model {

namespace {

/// Name of the switching function; "" for if.
std::string switching_function(const Expr& e) {
  const Call* call = as<Call>(e);
  return call ? std::string(name_of(call->fn)) : "";
}

bool is_mask(const Problem& problem, const std::string& name) {
  const Coefficient* coefficient = problem.find_coefficient(name);
  return coefficient != nullptr && coefficient->is_mask;
}

/// A switch in the run's formulas that depends on the unknown.
std::optional<Expr> switch_moved_by(std::size_t unknown, const Problem& problem, const Influence& influence) {
  std::optional<Expr> found;
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (found || (!formula.is_of_loss && !influence.reaches_losses(formula.makes))) return;
    any_part(*formula.value, [&](const Expr& part) {
      const Expr* operand = operand_of_switch(part);
      if (!found && operand && influence.on(names_read(*operand)).any.contains(unknown)) found = part;
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
    const bool sets_length =
        problem.substeps.rate && influence.on(names_read(*problem.substeps.rate)).any.contains(unknown);
    result.push_back(
        {unknown, origin, found ? switching_function(*found) : "", sets_length && !origin.range.is_known()});
  }
  return result;
}

namespace {

/// Calls `look` on the formula, then on the operands of its non-arithmetic parts, until `look` returns true.
void look_inside(const Expr& formula, const Problem& problem, const Movement& movement,
                 const std::function<bool(FormulaSymbols&, const FormulaSymbols::Inner&)>& look) {
  std::vector<FormulaSymbols::Inner> waiting{{formula, {}, ""}};
  while (!waiting.empty()) {
    const FormulaSymbols::Inner next = waiting.back();
    waiting.pop_back();
    if (!may_jump(next.value)) continue;
    FormulaSymbols converter(problem, movement, next);
    if (look(converter, next)) return;
    waiting.insert(waiting.end(), converter.inner().begin(), converter.inner().end());
  }
}

/// Factors at whose zeros `e` is 0: for (p*q)^2 they are p and q.
void add_factors(const Expr& e, std::vector<Expr>& factors) {
  const Neg* neg = as<Neg>(e);
  if (neg != nullptr) return add_factors(neg->operand, factors);
  const Binary* binary = as<Binary>(e);
  const bool is_product = binary && (binary->op == BinaryOp::multiply || binary->op == BinaryOp::divide);
  if (is_product || (binary && binary->op == BinaryOp::power)) add_factors(binary->left, factors);
  if (is_product) add_factors(binary->right, factors);
  if (binary && (is_product || binary->op == BinaryOp::power)) return;
  const Call* call = as<Call>(e);
  if (call && (call->fn == Fn::abs || call->fn == Fn::sqrt)) return add_factors(call->arguments.front(), factors);
  if (!is<Number>(e)) factors.push_back(e);
}

std::vector<Expr> factors_of_divisor(const Expr& pole) {
  const Call* call = as<Call>(pole);
  const Expr& operand = *operand_of_pole(pole);
  std::vector<Expr> factors;
  add_factors(call && call->fn == Fn::tan ? model::call(Fn::cos, {operand}) : operand, factors);
  return factors;
}

/// With states and coefficients replaced by their initial formulas; nullopt if one has none.
std::optional<Expr> at_the_start(const Expr& e, const Problem& problem) {
  if (const Field* field = as<Field>(e)) {
    const State* state = problem.find_state(field->name);
    const Coefficient* coefficient = problem.find_coefficient(field->name);
    return state ? state->initial.formula : coefficient ? coefficient->value.formula : std::nullopt;
  }
  bool is_known = true;
  const Expr result = map_children(e, [&](const Expr& part) {
    const std::optional<Expr> value = at_the_start(part, problem);
    is_known = is_known && value;
    return value.value_or(part);
  });
  return is_known ? std::optional(result) : std::nullopt;
}

/// nullopt if the formulas do not determine it, 0 if both signs occur.
std::optional<double> sign_at_the_start(const Expr& e, const Problem& problem) {
  const std::optional<Expr> start = at_the_start(e, problem);
  const Movement nothing{[](const std::string&) { return false; }};
  return start ? find_sign(FormulaSymbols(problem, nothing, {*start, {}, ""}).formula()) : std::nullopt;
}

/// Whether an unknown moves the initial zeros of `e`, or is a field in it.
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
  return std::ranges::any_of(names_read(e).any, is_sought) || std::ranges::any_of(factors, [&](const Expr& factor) {
           return std::ranges::any_of(names_read(factor).any, is_moved) &&
                  sign_at_the_start(factor, problem).value_or(0) == 0;
         });
}

std::optional<Expr> side_of(const Expr& e, const LocalFields& scope) {
  const Select* select = as<Select>(e);
  const Call* call = as<Call>(e);
  std::optional<Expr> side;
  if (select != nullptr) {
    const std::optional<Expr> condition = in_terms_of_problem(select->condition, scope);
    if (condition) side = model::select(*condition, number(1), number(-1), e->origin);
  } else if (call != nullptr && call->fn == Fn::sign) {
    side = in_terms_of_problem(call->arguments.front(), scope);
  }
  return side;
}

Jump jump_of(const Expr& e, const FormulaSymbols::Inner& in, const Movement& movement) {
  Jump jump{e->origin, switching_function(e), {}, in.within, operand_of_switch(e) == nullptr};
  jump.side = side_of(e, in.scope);
  for (const std::string& name : names_read(*operand_of_jump(e)).any) {
    if (movement.moves(name)) jump.movers.push_back(name);
  }
  return jump;
}

/// One jump after the other; each search assumes that the branches meet at those found before.
void add_jumps(const Expr& formula, const FormulaPlace& in, const Problem& problem, const Movement& movement,
               std::vector<Jump>& jumps) {
  look_inside(formula, problem, movement, [&](FormulaSymbols& converter, const FormulaSymbols::Inner& next) {
    while (const std::optional<Piecewise::Id> found = find_jump(converter.formula())) {
      jumps.push_back(jump_of(converter.source_of(*found), next, movement));
      jumps.back().in = in;
      const bool begins_on_both = jumps.back().side && sign_at_the_start(*jumps.back().side, problem) == 0.0;
      if (begins_on_both && !in.event) jumps.back().side = std::nullopt;
      converter.trust(*found);
      if (!jumps.back().side) break;  // the jump will be rejected
    }
    return false;
  });
}

}  // namespace

std::optional<Jump> jump_in(const Expr& formula, const Problem& problem, const Movement& movement) {
  std::optional<Jump> jump;
  look_inside(formula, problem, movement, [&](const FormulaSymbols& converter, const FormulaSymbols::Inner& next) {
    const std::optional<Piecewise::Id> found = find_jump(converter.formula());
    if (found) jump = jump_of(converter.source_of(*found), next, movement);
    return found.has_value();
  });
  return jump;
}

namespace {

Movement movement_of(const Influence& influence, Signs signs) {
  return {[&](const std::string& name) { return !influence.on(name).any.empty(); }, false, signs};
}

/// Appends all divisors at whose zeros the formula jumps, whatever the signs of fields, except zeros that nothing
/// moves. A zero without a change of sign gives no `value`: a run cannot detect it.
void add_divisors(const Expr& formula, const FormulaPlace& in, const Problem& problem, const Influence& influence,
                  std::vector<Divisor>& divisors) {
  const Movement movement = movement_of(influence, Signs::any);
  const auto is_still = [&](const Expr& value) { return std::ranges::none_of(names_read(value).any, movement.moves); };
  look_inside(formula, problem, movement, [&](FormulaSymbols& converter, const FormulaSymbols::Inner& next) {
    while (const std::optional<Piecewise::Id> found = find_jump(converter.formula())) {
      const Expr& pole = converter.source_of(*found);
      converter.trust(*found);
      if (operand_of_switch(pole) != nullptr) continue;
      for (const Expr& factor : factors_of_divisor(pole)) {
        const std::optional<Expr> value = in_terms_of_problem(factor, next.scope);
        if (value && is_still(*value)) continue;
        const bool is_one_sign = value && (sign_at_the_start(*value, problem).value_or(0) != 0 ||
                                           moves_its_start(*value, problem, influence));
        divisors.push_back({value, pole->origin, is_one_sign, in});
        const Expr reciprocal = binary(BinaryOp::divide, 1.0, factor, pole->origin);
        if (touches_zero(FormulaSymbols(problem, movement, {reciprocal, next.scope, ""}).formula()))
          divisors.push_back({std::nullopt, pole->origin, false, in});
      }
    }
    return false;
  });
}

/// The problem's event with this formula, unless it happens after each step.
std::optional<std::size_t> event_of(const Problem& problem, const Expr* formula) {
  const auto has_it = [&](const Event& event) {
    return std::ranges::any_of(event.updates, [&](const Event::Update& update) { return &update.value == formula; });
  };
  const auto found = std::ranges::find_if(problem.events, has_it);
  if (found == problem.events.end() || found->after_step || found->every == 1) return std::nullopt;
  return static_cast<std::size_t>(found - problem.events.begin());
}

/// Calls `f` on each formula that the losses depend on, with its location. Formulas of masks are skipped, as they must
/// not contain unknowns.
void for_each_judged_formula(const Problem& problem, const Influence& influence,
                             const std::function<void(const Expr&, const FormulaPlace&)>& f) {
  const std::vector<Loss>& losses = problem.task->losses;
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (formula.is_of_length || is_mask(problem, formula.makes)) return;
    const auto loss = std::ranges::find_if(losses, [&](const Loss& one) { return &one.value == formula.value; });
    FormulaPlace in;
    if (loss != losses.end()) in.loss = static_cast<std::size_t>(loss - losses.begin());
    if (formula.kind == UseKind::equation) in.equation = formula.makes;
    if (formula.kind == UseKind::event) in.event = event_of(problem, formula.value);
    in.is_in_each_step = formula.kind == UseKind::event && !in.event;
    if (formula.is_of_loss || influence.reaches_losses(formula.makes)) f(*formula.value, in);
  });
}

}  // namespace

std::vector<Jump> jumps_of(const Problem& problem, const Influence& influence, Signs signs) {
  const Movement movement = movement_of(influence, signs);
  std::vector<Jump> jumps;
  for_each_judged_formula(problem, influence, [&](const Expr& formula, const FormulaPlace& in) {
    add_jumps(formula, in, problem, movement, jumps);
  });
  return jumps;
}

std::vector<Divisor> trusted_divisors(const Problem& problem, const Influence& influence) {
  const Movement kept = movement_of(influence, Signs::kept);
  std::vector<Divisor> divisors;
  for_each_judged_formula(problem, influence, [&](const Expr& formula, const FormulaPlace& in) {
    if (!jump_in(formula, problem, kept)) add_divisors(formula, in, problem, influence, divisors);
  });
  return divisors;
}

}  // namespace dpde::model
