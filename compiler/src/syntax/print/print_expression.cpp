// SPDX-License-Identifier: Apache-2.0
// Prints with minimal parentheses; a - b, a*b, a^b, f(x, n = 1), u[+1, 0].
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "support/match.h"
#include "support/vocabulary.h"
#include "syntax/print/print_ast.h"

namespace dpde::ast {
namespace {

// Binding strength, twice the precedence of vocabulary.h: `not` is between `and` and the comparisons.
constexpr int not_binding = 5;
constexpr int negation_binding = 2 * unary_precedence;
constexpr int atom_binding = 100;

int binding(const Expr& expr) {
  if (const auto* binary = std::get_if<Binary>(&expr->kind)) return 2 * precedence(binary->op);
  if (const auto* number = std::get_if<Number>(&expr->kind)) return number->value < 0 ? negation_binding : atom_binding;
  const auto* unary = std::get_if<Unary>(&expr->kind);
  if (unary == nullptr || unary->op == UnaryOp::magnitude) return atom_binding;
  return unary->op == UnaryOp::negate ? negation_binding : not_binding;
}

class Printer {
 public:
  std::string take() { return std::move(text_); }

  void print(const Expr& expr, int lowest = 0) {
    const bool parentheses = binding(expr) < lowest;
    if (parentheses) text_ += '(';
    match(
        expr->kind, [&](const Number& n) { text_ += n.spelling.empty() ? fmt::format("{}", n.value) : n.spelling; },
        [&](const Text& t) { append("\"{}\"", t.value); }, [&](const Name& n) { text_ += n.name; },
        [&](const Unary& u) { print_unary(u); }, [&](const Binary& b) { print_binary(b); },
        [&](const Call& c) { print_call(c); }, [&](const Tuple& t) { print_tuple(t); },
        [&](const Offsets& o) { print_offsets(o); }, [&](const Component& c) { print_component(c); },
        [&](const Error&) { text_ += "<error>"; });
    if (parentheses) text_ += ')';
  }

 private:
  template <class... Arguments>
  void append(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    text_ += fmt::format(format, std::forward<Arguments>(arguments)...);
  }

  void print_unary(const Unary& unary) {
    if (unary.op == UnaryOp::magnitude) {
      text_ += '|';
      print(unary.operand);
      text_ += '|';
      return;
    }
    const bool is_not = unary.op == UnaryOp::logical_not;
    text_ += is_not ? "not " : "-";
    // `not not a` and `not a < b` need no parentheses
    print(unary.operand, is_not ? not_binding : negation_binding);
  }

  void print_binary(const Binary& binary) {
    const int own = 2 * precedence(binary.op);
    const bool is_power = binary.op == BinaryOp::power;
    const bool is_comparison = own == 2 * precedence(BinaryOp::less);
    print(binary.left, is_power || is_comparison ? own + 1 : own);
    const bool is_tight = own >= 2 * precedence(BinaryOp::multiply);
    const char* gap = is_tight ? "" : " ";
    append("{}{}{}", gap, spelling(binary.op), gap);
    // a*(-b), not a*-b
    print(binary.right, is_power ? own : std::max(own + 1, is_tight ? negation_binding + 1 : 0));
  }

  void print_call(const Call& call) {
    append("{}(", call.callee);
    const char* separator = "";
    for (const Argument& argument : call.arguments) {
      text_ += separator;
      if (!argument.name.empty()) append("{} = ", argument.name);
      print(argument.value);
      separator = ", ";
    }
    text_ += ')';
  }

  void print_component(const Component& component) {
    const Kind& kind = component.operand->kind;
    const bool stands_alone = std::holds_alternative<Call>(kind) || std::holds_alternative<Tuple>(kind);
    if (!stands_alone) text_ += '(';
    print(component.operand);
    if (!stands_alone) text_ += ')';
    append(".{}", component.name.name);
  }

  void print_tuple(const Tuple& tuple) {
    const char* separator = "(";
    for (const Expr& element : tuple.elements) {
      text_ += separator;
      print(element);
      separator = ", ";
    }
    text_ += ')';
  }

  void print_offsets(const Offsets& offsets) {
    text_ += offsets.name;
    const char* separator = "[";
    for (const int offset : offsets.offsets) {
      append("{}{}{}", separator, offset > 0 && offsets.has_signs ? "+" : "", offset);
      separator = ", ";
    }
    text_ += ']';
    if (offsets.grow != 0) append(" grow {}", offsets.grow);
  }

  std::string text_;
};

}  // namespace

std::string print(const Expr& expr) {
  Printer printer;
  printer.print(expr);
  return printer.take();
}

}  // namespace dpde::ast
