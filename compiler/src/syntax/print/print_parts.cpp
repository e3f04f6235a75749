// SPDX-License-Identifier: Apache-2.0
#include "syntax/print/print_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "support/match.h"
#include "syntax/print/print_ast.h"

namespace dpde::ast {

std::string print_names(const std::vector<Identifier>& names) {
  std::vector<std::string_view> texts;
  for (const Identifier& name : names) texts.push_back(name.name);
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::string print_list(const std::vector<Expr>& values) {
  std::vector<std::string> texts;
  for (const Expr& value : values) texts.push_back(print(value));
  return fmt::format("{}", fmt::join(texts, ", "));
}

namespace {

std::string print_over(const std::optional<Identifier>& counted) {
  return counted ? fmt::format(", {} over ", counted->name) : " over ";
}

}  // namespace

std::string print_when(const When& when) {
  return match(
      when, [](const WhenEnd&) { return std::string(); },
      [](const WhenOver& over) { return print_over(over.counted) + "time"; },
      [](const WhenSteps& over) {
        return fmt::format("{}{} steps", over.is_last ? " after " : print_over(over.counted), print(over.steps));
      },
      [](const WhenAt& at) { return " at t = " + print_list(at.times); });
}

std::string print_placement(const std::optional<Identifier>& on) { return on ? " on " + on->name : ""; }

std::string print_formulas(const std::vector<NamedFormula>& formulas) {
  std::string text;
  for (const NamedFormula& each : formulas) {
    text += (text.empty() ? "" : ", ") + each.name.name + print_placement(each.on);
    if (each.value) text += " = " + print(*each.value);
  }
  return text;
}

std::string print_unit(const UnitText& unit) { return unit ? " in " + unit->name : ""; }

namespace {

bool are_same(const UnitText& a, const UnitText& b) { return a && b && a->name == b->name; }

/// With a common unit at the end.
std::string print_declared(const std::vector<Identifier>& names, const std::vector<UnitText>& units,
                           const std::optional<Identifier>& on) {
  const bool are_alike =
      std::ranges::all_of(units, [&](const UnitText& unit) { return are_same(unit, units.front()); });
  if (are_alike) return print_names(names) + print_placement(on) + print_unit(units.front());
  return print_names(names, units) + print_placement(on);
}

}  // namespace

std::string print_names(const std::vector<Identifier>& names, const std::vector<UnitText>& units) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool goes_on = i + 1 < names.size() && are_same(units[i], units[i + 1]);
    text += (i > 0 ? ", " : "") + names[i].name + (goes_on ? "" : print_unit(units[i]));
  }
  return text;
}

std::string print_field(const FieldItem& i) {
  return (i.vector ? "vector " : "field ") + print_declared(i.names, i.units, i.on);
}

std::string print_coefficient(const CoefficientItem& i) {
  const char* word = i.mask ? "mask " : i.control ? "control " : "coefficient ";
  const char* kind = i.vector ? "vector " : i.control ? "field " : "";
  return word + std::string(kind) + print_declared(i.names, i.units, i.on);
}

std::string print_params(const ParamItem& item) {
  std::string text = "param ";
  for (std::size_t i = 0; i < item.names.size(); ++i) {
    text += (i > 0 ? ", " : "") + item.names[i].name;
    if (item.values[i]) text += " = " + print(*item.values[i]);
    const bool goes_on = !item.values[i] && i + 1 < item.names.size() && are_same(item.units[i], item.units[i + 1]);
    if (!goes_on) text += print_unit(item.units[i]);
  }
  return text;
}

static std::string print_starts(const std::vector<Expr>& starts) {
  std::string text;
  for (std::size_t i = 0; i < starts.size(); ++i) text += (i == 0 ? " from " : ", ") + print(starts[i]);
  return text;
}

static std::string print_preconditioner(const std::optional<Expr>& preconditioner) {
  return preconditioner ? " preconditioner " + print(*preconditioner) : "";
}

std::string print_solved(const SolvedItem& i) {
  const std::string after = i.iterations ? fmt::format(" after {} iterations", *i.iterations) : "";
  return fmt::format("solve {} = {} for {}{}{}{}{}", print(i.left), print(i.right), i.unknown.name, print_unit(i.unit),
                     print_starts(i.starts), print_preconditioner(i.preconditioner), after);
}

std::string print_constraint(const ConstraintItem& i) {
  return fmt::format("{} = {} gives {}{}{}{}", print(i.zero), print(i.value), i.multiplier.name,
                     i.each ? " each " + i.each->name : "", print_starts(i.starts),
                     print_preconditioner(i.preconditioner));
}

std::string print_solve_head(const SolveItem& solve) {
  std::string head = fmt::format("{} {} = {} for {}", solve.is_linear ? "solve" : "newton", print_names(solve.images),
                                 print_names(solve.rights), print_names(solve.unknowns));
  for (std::size_t i = 0; i < solve.guesses.size(); ++i) head += (i == 0 ? " from " : ", ") + solve.guesses[i].name;
  if (solve.method) head += " by " + solve.method->name;
  if (solve.smoother) head += " smoother " + solve.smoother->name;
  if (solve.preconditioner) head += " preconditioner " + solve.preconditioner->name;
  if (solve.network)
    head += fmt::format(" preconditioner {}({}) to {}", solve.network->network.name, print_names(solve.network->inputs),
                        print_names(solve.network->to));
  if (solve.tolerance) head += " tolerance " + print(*solve.tolerance);
  if (solve.iterations) head += " iterations " + print(*solve.iterations);
  if (solve.warns) head += " or warn";
  return head;
}

std::string print_held(const HeldItem& i) {
  return fmt::format("{} = {} inside {}", i.field.name, print(i.value), i.mask.name);
}

std::string print_accuracy(const AccuracyItem& item) {
  return fmt::format("accuracy {}{}", print(item.tolerance),
                     item.fields.empty() ? "" : " on " + print_names(item.fields));
}

}  // namespace dpde::ast
