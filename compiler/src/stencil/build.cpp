// SPDX-License-Identifier: Apache-2.0
// Smart constructors. The result has the value of the plain node whenever that value is finite. Signs move outwards
// (-a*b is -(a*b)) and into the leading number of a product, so that sums are written a - b, not a + -b.
#include "stencil/build.h"

#include <cmath>
#include <utility>

#include "support/assert.h"
#include "support/leading_number.h"
#include "support/maths/evaluate.h"
#include "support/names/bound_names.h"

namespace dpde::stencil {

namespace {

Expr make(Kind kind) { return Expr(Node{std::move(kind)}); }

Expr make_binary(BinaryOp op, const Expr& a, const Expr& b) { return make(Binary{op, a, b}); }

/// The result of `op` on two numbers; nullopt unless it is finite.
std::optional<Expr> fold(BinaryOp op, const Expr& a, const Expr& b) {
  const Literal* x = as<Literal>(a);
  const Literal* y = as<Literal>(b);
  if (!x || !y) return std::nullopt;
  const double value = evaluate_binary(op, x->value, y->value);
  if (!std::isfinite(value)) return std::nullopt;
  return Expr(value);
}

/// Folds functions only where all implementations agree: correctly rounded functions, and every function at 0.
std::optional<double> fold(Fn fn, double x) {
  switch (fn) {
    case Fn::sqrt: return x >= 0 ? std::optional(std::sqrt(x)) : std::nullopt;
    case Fn::abs: return std::abs(x);
    case Fn::sign: return (x > 0) - (x < 0);
    case Fn::floor: return std::floor(x);
    case Fn::fraction: return x - std::floor(x);
    case Fn::sin:
    case Fn::tan:
    case Fn::asin:
    case Fn::atan:
    case Fn::sinh:
    case Fn::tanh:
    case Fn::erf: return x == 0 ? std::optional(0.0) : std::nullopt;
    case Fn::cos:
    case Fn::cosh:
    case Fn::exp: return x == 0 ? std::optional(1.0) : std::nullopt;
    case Fn::log: return x == 1 ? std::optional(0.0) : std::nullopt;
    case Fn::acos:
    case Fn::min:
    case Fn::max: return std::nullopt;
  }
  unreachable("function");
}

Expr logical(BinaryOp op, const Expr& a, const Expr& b) {
  const bool absorbing = op == BinaryOp::logical_or;  // true absorbs in `or`, false in `and`
  for (const auto& [number, other] : {std::pair(a, b), std::pair(b, a)}) {
    const Literal* literal = as<Literal>(number);
    if (!literal) continue;
    if ((literal->value != 0) == absorbing) return absorbing ? 1.0 : 0.0;
    if (is_truth(other)) return other;
  }
  if (a == b && is_truth(a)) return a;
  return make_binary(op, a, b);
}

}  // namespace

bool is_truth(const Expr& e) {
  if (as<Inside>(e) || is_literal(e, 0) || is_literal(e, 1)) return true;
  const Binary* b = as<Binary>(e);
  return b && precedence(b->op) <= precedence(BinaryOp::less);
}

Expr param(std::string name) { return make(Param{std::move(name)}); }
Expr local(std::string name) { return make(Local{std::move(name)}); }
Expr access(std::string field, Offset offset) { return make(Access{std::move(field), offset}); }
Expr inside(Offset offset, int grow) { return make(Inside{offset, grow}); }
Expr interp(Interp value) { return make(std::move(value)); }

bool is_coordinate(const std::string& field) {
  const BoundName* known = find_bound_name(field);
  return known != nullptr && known->kind == BoundNameKind::coordinate;
}

Expr operator-(const Expr& a) {
  if (const Neg* neg = as<Neg>(a)) return neg->operand;
  if (is_literal(a, 0)) return 0.0;
  if (const std::optional<Expr> negated = negate_leading_number(a)) return *negated;
  return make(Neg{a});
}

Expr negate(const Expr& a) { return -a; }

Expr slope_of_tanh(const Expr& a) { return 1.0 - power(call(Fn::tanh, {a}), 2.0); }

Expr operator+(const Expr& a, const Expr& b) {
  if (const auto number = fold(BinaryOp::add, a, b)) return *number;
  if (is_literal(a, 0)) return b;
  if (is_literal(b, 0)) return a;
  if (const auto positive = without_minus(b)) return a - *positive;
  if (const Neg* neg = as<Neg>(a)) return b - neg->operand;
  return make_binary(BinaryOp::add, a, b);
}

Expr operator-(const Expr& a, const Expr& b) {
  if (const auto number = fold(BinaryOp::subtract, a, b)) return *number;
  if (is_literal(a, 0)) return -b;
  if (is_literal(b, 0)) return a;
  if (const auto positive = without_minus(b)) return a + *positive;
  return make_binary(BinaryOp::subtract, a, b);
}

Expr operator*(const Expr& a, const Expr& b) {
  if (const auto number = fold(BinaryOp::multiply, a, b)) return *number;
  if (is_literal(a, 0) || is_literal(b, 0)) return 0.0;
  if (is_literal(a, 1)) return b;
  if (is_literal(b, 1)) return a;
  if (is_literal(a, -1)) return -b;
  if (is_literal(b, -1)) return -a;
  if (const Neg* neg = as<Neg>(a)) return -(neg->operand * b);
  if (const Neg* neg = as<Neg>(b)) return -(a * neg->operand);
  return make_binary(BinaryOp::multiply, a, b);
}

Expr operator/(const Expr& a, const Expr& b) {
  if (const auto number = fold(BinaryOp::divide, a, b)) return *number;
  if (is_literal(a, 0) && !is<Literal>(b)) return 0.0;
  if (is_literal(b, 1)) return a;
  if (is_literal(b, -1)) return -a;
  if (const Neg* neg = as<Neg>(a)) return -(neg->operand / b);
  if (const Neg* neg = as<Neg>(b)) return -(a / neg->operand);
  return make_binary(BinaryOp::divide, a, b);
}

Expr power(const Expr& base, const Expr& exponent) {
  if (const auto number = fold(BinaryOp::power, base, exponent)) return *number;
  if (is_literal(exponent, 0) || is_literal(base, 1)) return 1.0;
  if (is_literal(exponent, 1)) return base;
  return make_binary(BinaryOp::power, base, exponent);
}

Expr binary(BinaryOp op, const Expr& a, const Expr& b) {
  switch (op) {
    case BinaryOp::add: return a + b;
    case BinaryOp::subtract: return a - b;
    case BinaryOp::multiply: return a * b;
    case BinaryOp::divide: return a / b;
    case BinaryOp::power: return power(a, b);
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return logical(op, a, b);
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal: {
      const auto number = fold(op, a, b);
      return number ? *number : make_binary(op, a, b);
    }
  }
  unreachable("operator");
}

Expr call(Fn fn, std::vector<Expr> arguments) {
  require(static_cast<int>(arguments.size()) == arity(fn), "number of arguments");
  if (arguments.size() == 2) {
    if (arguments[0] == arguments[1]) return arguments[0];
    const Literal* a = as<Literal>(arguments[0]);
    const Literal* b = as<Literal>(arguments[1]);
    if (a && b) return fn == Fn::min ? std::min(a->value, b->value) : std::max(a->value, b->value);
  } else if (const Literal* x = as<Literal>(arguments[0])) {
    if (const std::optional<double> value = fold(fn, x->value)) return *value;
  }
  return make(Call{fn, std::move(arguments)});
}

Expr select(const Expr& condition, const Expr& yes, const Expr& no) {
  if (const Literal* literal = as<Literal>(condition)) return literal->value != 0 ? yes : no;
  const Select* in_yes = as<Select>(yes);
  const Select* in_no = as<Select>(no);
  if (in_yes && in_yes->condition == condition) return select(condition, in_yes->yes, no);
  if (in_no && in_no->condition == condition) return select(condition, yes, in_no->no);
  if (yes == no) return yes;
  return make(Select{condition, yes, no});
}

std::string add_kernel(Module& module, Kernel kernel) {
  const std::string wish = kernel.name;
  for (int n = 2; const Kernel* other = module.find_kernel(kernel.name); ++n) {
    if (*other == kernel) return kernel.name;
    kernel.name = wish + "_" + std::to_string(n);
  }
  module.kernels.push_back(std::move(kernel));
  return module.kernels.back().name;
}

}  // namespace dpde::stencil
