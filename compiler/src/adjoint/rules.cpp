// SPDX-License-Identifier: Apache-2.0
#include "adjoint/rules.h"

#include "stencil/build.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/derivatives.h"

namespace dpde::adjoint {

using namespace stencil;  // the calculus reads as formulas

Expr times_partial(const Expr& e, int index, const Expr& x) {
  using Table = Derivatives<Expr>;
  return match(
      e->kind, [&](const Neg&) { return -x; },
      [&](const Binary& b) { return Table::times_partial(b.op, b.left, b.right, index, x); },
      [&](const Call& c) { return Table::times_partial(c.fn, c.arguments, index, x); },
      [](const OneOf<Literal, Param, Local, Access, Interp, Inside, Select> auto&) -> Expr {
        unreachable("times_partial of what has no operator");
      });
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
