// SPDX-License-Identifier: Apache-2.0
#include "codegen/cpp/cpp_expression.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <string_view>

#include "codegen/elementary_functions.h"
#include "loop/expressions.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/vocabulary.h"

namespace dpde::codegen {

namespace {

constexpr int atom = 9;
constexpr int product_precedence = 5;
constexpr int comparison_precedence = 3;
constexpr int choice_precedence = 0;

bool is_condition(BinaryOp op) { return precedence(op) <= comparison_precedence; }
bool is_logical(BinaryOp op) { return op == BinaryOp::logical_and || op == BinaryOp::logical_or; }

/// Suffix of the functions of <math.h>.
std::string_view suffix(Precision real) { return real == Precision::f32 ? "f" : ""; }

std::string_view cpp_function(Fn fn) {
  switch (fn) {
    case Fn::abs: return "fabs";
    case Fn::sign: return "dpde_sign";
    case Fn::fraction: return "dpde_fraction";
    case Fn::min: return "dpde_min";
    case Fn::max: return "dpde_max";
    case Fn::sin:
    case Fn::cos:
    case Fn::tan:
    case Fn::asin:
    case Fn::acos:
    case Fn::atan:
    case Fn::sinh:
    case Fn::cosh:
    case Fn::tanh:
    case Fn::exp:
    case Fn::log:
    case Fn::erf:
    case Fn::sqrt:
    case Fn::floor: return name_of(fn);
  }
  unreachable("function");
}

}  // namespace

std::string_view cpp_real(Precision real) { return real == Precision::f32 ? "float" : "double"; }

std::string cpp_number(double exact, Precision real) {
  const double value = rounded(exact, real);
  if (std::isnan(value)) return "NAN";
  if (std::isinf(value)) return value < 0 ? "-INFINITY" : "INFINITY";
  const bool is_single = real == Precision::f32;
  std::string text = is_single ? fmt::format("{}", static_cast<float>(value)) : fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return is_single ? text + "f" : text;
}

bool is_rounded_product(const loop::Rounded& r) {
  const loop::Binary* b = as<loop::Binary>(r.operand);
  return b && b->op == BinaryOp::multiply;
}

bool is_small_power(const loop::Binary& b) {
  return b.op == BinaryOp::power && (is_literal(b.right, 2) || is_literal(b.right, 3)) && loop::is_leaf(b.left);
}

std::string CppExpression::enclosed(const Piece& piece, int least) {
  return piece.precedence < least ? fmt::format("({})", piece.text) : piece.text;
}

std::string CppExpression::number(const loop::Expr& e, int least) const { return enclosed(number_piece(e), least); }
std::string CppExpression::truth(const loop::Expr& e, int least) const { return enclosed(truth_piece(e), least); }

bool CppExpression::is_truth(const loop::Expr& e) const {
  if (is<loop::Inside>(e)) return true;
  if (const loop::Local* l = as<loop::Local>(e)) return leaves_.let_is_truth[l->index];
  const loop::Binary* b = as<loop::Binary>(e);
  return b && is_condition(b->op);
}

CppExpression::Piece CppExpression::truth_piece(const loop::Expr& e) const {
  if (const loop::Inside* i = as<loop::Inside>(e)) return {leaves_.inside(*i), atom};
  if (const loop::Local* l = as<loop::Local>(e); l && leaves_.let_is_truth[l->index]) {
    return {leaves_.lets[l->index], atom};
  }
  if (const Literal* l = as<Literal>(e)) return {l->value != 0 ? "true" : "false", atom};
  const loop::Binary* b = as<loop::Binary>(e);
  if (!b || !is_condition(b->op))
    return {fmt::format("{} != {}", number(e, comparison_precedence + 1), cpp_number(0, real_)), comparison_precedence};
  const int own = precedence(b->op);
  if (!is_logical(b->op)) {
    return {fmt::format("{} {} {}", number(b->left, own + 1), spelling(b->op), number(b->right, own + 1)), own};
  }
  // `&` and `|`, not `&&` and `||`: branches keep g++ from vectorising some loops. Evaluating both sides is harmless.
  const loop::Binary* left = as<loop::Binary>(b->left);
  const std::string left_text = truth(b->left, left && left->op == b->op ? own : comparison_precedence + 1);
  return {fmt::format("{} {} {}", left_text, b->op == BinaryOp::logical_and ? '&' : '|',
                      truth(b->right, comparison_precedence + 1)),
          own};
}

CppExpression::Piece CppExpression::number_piece(const loop::Expr& e) const {
  if (is_truth(e)) {
    return {fmt::format("{} ? {} : {}", truth(e, comparison_precedence), cpp_number(1, real_), cpp_number(0, real_)),
            choice_precedence};
  }
  return match(
      e->kind,
      [&](const Literal& l) {
        return Piece{cpp_number(l.value, real_), std::signbit(l.value) ? unary_precedence : atom};
      },
      [&](const loop::Uniform& u) {
        return Piece{leaves_.uniforms[u.index], atom};
      },
      [&](const loop::Param& p) {
        return Piece{leaves_.params[p.index], atom};
      },
      [&](const loop::Counter& c) {
        return Piece{leaves_.counters[c.index], atom};
      },
      [&](const loop::Load& l) {
        return Piece{leaves_.loads[l.stream], atom};
      },
      [&](const loop::Local& l) {
        return Piece{leaves_.lets[l.index], atom};
      },
      [&](const loop::Inside&) -> Piece { unreachable("inside is a condition"); },
      [&](const loop::Interp& i) {
        return Piece{interp(i), atom};
      },
      [&](const loop::Neg& n) { return negation(n); }, [&](const loop::Rounded& r) { return rounded(r); },
      [&](const loop::Binary& b) { return binary(b); },
      [&](const loop::Call& c) {
        return Piece{call(c), atom};
      },
      [&](const loop::Select& s) {
        return Piece{
            fmt::format("{} ? {} : {}", truth(s.condition, comparison_precedence), number(s.yes, 1), number(s.no, 1)),
            choice_precedence};
      });
}

CppExpression::Piece CppExpression::rounded(const loop::Rounded& r) const {
  if (!is_rounded_product(r)) return number_piece(r.operand);
  const loop::Binary& product = std::get<loop::Binary>(r.operand->kind);
  return {fmt::format("dpde_product({}, {})", number(product.left), number(product.right)), atom};
}

/// -a*b may stand for -(a*b): both are the same number.
CppExpression::Piece CppExpression::negation(const loop::Neg& n) const {
  const Piece operand = number_piece(n.operand);
  if (operand.precedence == product_precedence) return {"-" + operand.text, product_precedence};
  return {"-" + enclosed(operand, unary_precedence + 1), unary_precedence};
}

CppExpression::Piece CppExpression::binary(const loop::Binary& b) const {
  if (b.op == BinaryOp::power) return power(b);
  const int own = precedence(b.op);
  const bool tight = own == product_precedence;
  const std::string left = number(b.left, own);
  const std::string right = number(b.right, tight ? unary_precedence + 1 : own + 1);
  return {fmt::format("{}{}{}{}{}", left, tight ? "" : " ", spelling(b.op), tight ? "" : " ", right), own};
}

CppExpression::Piece CppExpression::power(const loop::Binary& b) const {
  if (is_small_power(b)) {
    const std::string base = number(b.left);
    return {is_literal(b.right, 2) ? fmt::format("{0}*{0}", base) : fmt::format("{0}*{0}*{0}", base),
            product_precedence};
  }
  return {fmt::format("{}pow{}({}, {})", leaves_.elementary, suffix(real_), number(b.left), number(b.right)), atom};
}

std::string CppExpression::call(const loop::Call& c) const {
  std::vector<std::string> arguments;
  for (const loop::Expr& argument : c.arguments) arguments.push_back(number(argument));
  const std::string_view name = cpp_function(c.fn);
  const bool is_helper = name.starts_with("dpde_");
  return fmt::format("{}{}{}({})", is_elementary(c.fn) ? leaves_.elementary : "", name, is_helper ? "" : suffix(real_),
                     fmt::join(arguments, ", "));
}

std::string CppExpression::interp(const loop::Interp& i) const {
  std::vector<std::string> displacement;
  for (const loop::Expr& d : i.displacement) displacement.push_back(number(d));
  return leaves_.interp(i, displacement);
}

}  // namespace dpde::codegen
