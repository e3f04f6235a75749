// SPDX-License-Identifier: Apache-2.0
#include "syntax/print_parts.h"

#include <fmt/format.h>

#include "support/match.h"
#include "syntax/print_ast.h"

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
      [](const WhenSteps& over) { return fmt::format("{}{} steps", print_over(over.counted), print(over.steps)); },
      [](const WhenAt& at) { return " at t = " + print_list(at.times); });
}

std::string print_placement(const std::optional<Identifier>& on) { return on ? " on " + on->name : ""; }

std::string print_field(const FieldItem& i) {
  return (i.vector ? "vector " : "field ") + print_names(i.names) + print_placement(i.on);
}

std::string print_coefficient(const CoefficientItem& i) {
  const char* word = i.mask ? "mask " : i.control ? "control " : "coefficient ";
  const char* kind = i.vector ? "vector " : i.control ? "field " : "";
  return fmt::format("{}{}{}{}", word, kind, print_names(i.names), print_placement(i.on));
}

std::string print_params(const ParamItem& item) {
  std::string text = "param ";
  for (std::size_t i = 0; i < item.names.size(); ++i) {
    text += (i > 0 ? ", " : "") + item.names[i].name;
    if (item.values[i]) text += " = " + print(*item.values[i]);
  }
  return text;
}

std::string print_solved(const SolvedItem& i) {
  return fmt::format("solve {} = {} for {}", print(i.left), print(i.right), i.unknown.name);
}

std::string print_constraint(const ConstraintItem& i) {
  return fmt::format("{} = {} gives {}", print(i.zero), print(i.value), i.multiplier.name);
}

std::string print_held(const HeldItem& i) {
  return fmt::format("{} = {} inside {}", i.field.name, print(i.value), i.mask.name);
}

std::string print_accuracy(const AccuracyItem& item) {
  return fmt::format("accuracy {}{}", print(item.tolerance),
                     item.fields.empty() ? "" : " on " + print_names(item.fields));
}

}  // namespace dpde::ast
