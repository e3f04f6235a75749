// SPDX-License-Identifier: Apache-2.0
#include "adjoint/rules.h"

#include "stencil/build.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;  // the calculus reads as formulas

namespace {

Expr partial_of_power(const Binary& p, int index, const Expr& x) {
  if (index == 1) {  // d(a^b)/db = a^b log a, and its limit 0 at a = 0
    return select(binary(BinaryOp::equal, p.left, 0.0), 0.0, x * (power(p.left, p.right) * call(Fn::log, {p.left})));
  }
  if (is_literal(p.right, 2)) return x * (2.0 * p.left);
  const auto* exponent = std::get_if<Literal>(&p.right->kind);
  if (exponent != nullptr && exponent->value < 0) return x / p.left * (p.right * power(p.left, p.right));  // a divisor
  return x * (p.right * power(p.left, p.right - 1.0));  // d(a^b)/da = b a^(b-1)
}

/// The square of a divisor need not be a float where what is divided by it is.
Expr partial_of_binary(const Binary& b, int index, const Expr& x) {
  switch (b.op) {
    case BinaryOp::add: return x;
    case BinaryOp::subtract: return index == 0 ? x : -x;
    case BinaryOp::multiply: return index == 0 ? x * b.right : x * b.left;
    case BinaryOp::divide: return index == 0 ? x / b.right : -(x / b.right * (b.left / b.right));
    case BinaryOp::power: return partial_of_power(b, index, x);
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return 0.0;
  }
  unreachable("operator");
}

Expr partial_of_min_max(BinaryOp takes_first, const Expr& a, const Expr& b, int index, const Expr& x) {
  const Expr first = binary(takes_first, a, b);
  return index == 0 ? select(first, x, 0.0) : select(first, 0.0, x);
}

Expr partial_of_call(const Call& c, int index, const Expr& x) {
  const Expr& a = c.arguments[0];
  switch (c.fn) {
    case Fn::sin: return x * call(Fn::cos, {a});
    case Fn::cos: return -(x * call(Fn::sin, {a}));
    case Fn::tan: return x * (1.0 + power(call(Fn::tan, {a}), 2.0));
    case Fn::asin: return x / call(Fn::sqrt, {1.0 - power(a, 2.0)});
    case Fn::acos: return -(x / call(Fn::sqrt, {1.0 - power(a, 2.0)}));
    case Fn::atan: return x / (1.0 + power(a, 2.0));
    case Fn::sinh: return x * call(Fn::cosh, {a});
    case Fn::cosh: return x * call(Fn::sinh, {a});
    case Fn::tanh: return x * (1.0 - power(call(Fn::tanh, {a}), 2.0));
    case Fn::exp: return x * call(Fn::exp, {a});
    case Fn::log: return x / a;
    case Fn::sqrt: return x / (2.0 * call(Fn::sqrt, {a}));
    case Fn::abs: return x * call(Fn::sign, {a});
    case Fn::sign: return 0.0;
    case Fn::floor: return 0.0;
    case Fn::fraction: return x;  // at a whole number that of the right-hand side
    case Fn::min: return partial_of_min_max(BinaryOp::less, a, c.arguments[1], index, x);
    case Fn::max: return partial_of_min_max(BinaryOp::greater_equal, a, c.arguments[1], index, x);
  }
  unreachable("function");
}

}  // namespace

Expr times_partial(const Expr& e, int index, const Expr& x) {
  const Kind& kind = e->kind;
  if (std::holds_alternative<Neg>(kind)) return -x;
  if (const auto* b = std::get_if<Binary>(&kind)) return partial_of_binary(*b, index, x);
  if (const auto* c = std::get_if<Call>(&kind)) return partial_of_call(*c, index, x);
  unreachable("times_partial of a leaf");
}

bool is_varied(const Expr& e, const Varied& varied) {
  return match(
      e->kind,  //
      [&](const Literal&) { return false; }, [&](const Param& p) { return varied.params.contains(p.name); },
      [&](const Local& l) { return varied.locals.contains(l.name); },
      [&](const Access& a) { return varied.fields.contains(a.field); },
      [&](const Interp& i) {
        if (varied.fields.contains(i.field)) return true;
        for (const Expr& d : i.displacement) {
          if (is_varied(d, varied)) return true;
        }
        return false;
      },
      [&](const Inside&) { return false; },  //
      [&](const Neg& n) { return is_varied(n.operand, varied); },
      [&](const Binary& b) {
        if (precedence(b.op) < precedence(BinaryOp::add)) return false;  // comparisons and logic
        // the right one first: sums are deep on the left, and the walk asks at each level
        return is_varied(b.right, varied) || is_varied(b.left, varied);
      },
      [&](const Call& c) {
        if (c.fn == Fn::sign || c.fn == Fn::floor) return false;
        for (const Expr& a : c.arguments) {
          if (is_varied(a, varied)) return true;
        }
        return false;
      },
      [&](const Select& s) { return is_varied(s.yes, varied) || is_varied(s.no, varied); });
}

std::set<std::string> varied_locals(const Kernel& kernel, const Varied& outside) {
  Varied varied{outside.fields, outside.params, {}};
  for (const Let& let : kernel.lets) {
    if (is_varied(let.value, varied)) varied.locals.insert(let.name);
  }
  return varied.locals;
}

}  // namespace dpde::adjoint
