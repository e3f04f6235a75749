// SPDX-License-Identifier: Apache-2.0
// Traversals and rewrites of expressions. Every rebuild goes through the smart constructors, so results stay folded.
#include <algorithm>

#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

std::vector<Expr> map_all(const std::vector<Expr>& expressions, const std::function<Expr(const Expr&)>& f) {
  std::vector<Expr> mapped;
  mapped.reserve(expressions.size());
  for (const Expr& e : expressions) mapped.push_back(f(e));
  return mapped;
}

Offset moved(Offset offset, const Offset& by) {
  for (int axis = 0; axis < max_rank; ++axis) offset[axis] += by[axis];
  return offset;
}

}  // namespace

Expr map_children(const Expr& e, const std::function<Expr(const Expr&)>& f) {
  return match(
      e->kind, [&](const OneOf<Literal, Param, Local, Access, Inside> auto&) { return e; },
      [&](const Interp& i) {
        return interp({i.field, i.offset, map_all(i.displacement, f), i.along});
      },
      [&](const Neg& n) { return -f(n.operand); },
      [&](const Binary& b) {
        const Expr left = f(b.left);
        return binary(b.op, left, f(b.right));
      },
      [&](const Call& c) { return call(c.fn, map_all(c.arguments, f)); },
      [&](const Select& s) {
        const Expr condition = f(s.condition);
        const Expr yes = f(s.yes);
        return select(condition, yes, f(s.no));
      });
}

void for_each_child(const Expr& e, const std::function<void(const Expr&)>& f) {
  match(
      e->kind, ignored<Literal, Param, Local, Access, Inside>,
      [&](const Interp& i) { std::for_each(i.displacement.begin(), i.displacement.end(), f); },
      [&](const Neg& n) { f(n.operand); },
      [&](const Binary& b) {
        f(b.left);
        f(b.right);
      },
      [&](const Call& c) { std::for_each(c.arguments.begin(), c.arguments.end(), f); },
      [&](const Select& s) {
        f(s.condition);
        f(s.yes);
        f(s.no);
      });
}

void visit(const Expr& e, const std::function<void(const Expr&)>& f) {
  f(e);
  for_each_child(e, [&](const Expr& child) { visit(child, f); });
}

Expr shift(const Expr& e, Offset k, const std::function<std::string(const std::string&)>& rename) {
  const auto below = [&](const Expr& child) { return shift(child, k, rename); };
  if (const Local* l = std::get_if<Local>(&e->kind)) return local(rename(l->name));
  if (const Access* a = std::get_if<Access>(&e->kind)) return access(a->field, moved(a->offset, k));
  if (const Inside* i = std::get_if<Inside>(&e->kind)) return inside(moved(i->offset, k), i->grow);
  if (const Interp* i = std::get_if<Interp>(&e->kind)) {
    return interp({i->field, moved(i->offset, k), map_all(i->displacement, below), i->along});
  }
  return map_children(e, below);
}

Expr substitute_params(const Expr& e, const std::map<std::string, Expr>& values) {
  if (const Param* p = std::get_if<Param>(&e->kind)) {
    const auto found = values.find(p->name);
    return found == values.end() ? e : found->second;
  }
  return map_children(e, [&](const Expr& child) { return substitute_params(child, values); });
}

Expr rename_fields(const Expr& e, const std::function<std::string(const std::string&)>& rename) {
  const auto below = [&](const Expr& child) { return rename_fields(child, rename); };
  if (const Access* a = std::get_if<Access>(&e->kind)) return access(rename(a->field), a->offset);
  if (const Interp* i = std::get_if<Interp>(&e->kind)) {
    return interp({rename(i->field), i->offset, map_all(i->displacement, below), i->along});
  }
  return map_children(e, below);
}

Kernel map_kernel(const Kernel& kernel, const std::function<Expr(const Expr&)>& f) {
  Kernel mapped = kernel;
  for (Let& let : mapped.lets) let.value = f(let.value);
  for (Store& store : mapped.stores) store.value = f(store.value);
  for (Sum& sum : mapped.sums) sum.value = f(sum.value);
  for (Scatter& scatter : mapped.scatters) {
    scatter.target.displacement = map_all(scatter.target.displacement, f);
    scatter.value = f(scatter.value);
  }
  return mapped;
}

bool reads_param(const Expr& e, const std::string& name) {
  bool found = false;
  visit(e, [&](const Expr& part) {
    const auto* param = std::get_if<Param>(&part->kind);
    found = found || (param != nullptr && param->name == name);
  });
  return found;
}

}  // namespace dpde::stencil
