// SPDX-License-Identifier: Apache-2.0
// Traversals and rewrites of expressions. Every rebuild goes through the smart constructors, so results stay folded.
#include <algorithm>

#include "stencil/build.h"
#include "support/match.h"

template class dpde::ExprOf<dpde::stencil::Node>;

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

template <class AnyNode, class F>
void on_children(AnyNode& node, const F& f) {
  match(node.kind, ignored<Literal, Param, Local, Access, Inside>, children_of_operators<Expr>(f),
        [&](OneOf<Interp> auto& i) { std::ranges::for_each(i.displacement, f); });
}

}  // namespace

void for_each_child(const Node& node, FunctionRef<void(const Expr&)> f) { on_children(node, f); }
void for_each_child(Node& node, FunctionRef<void(Expr&)> f) { on_children(node, f); }

Expr rebuilt(Node node) {
  return match(
      node.kind, [&](const OneOf<Literal, Param, Local, Access, Inside> auto&) { return Expr(std::move(node)); },
      [](const Interp& i) { return interp(i); }, [](const Neg& n) { return -n.operand; },
      [](const Binary& b) { return binary(b.op, b.left, b.right); },
      [](const Call& c) { return call(c.fn, c.arguments); },
      [](const Select& s) { return select(s.condition, s.yes, s.no); });
}

Expr shift(const Expr& e, Offset k, const std::function<std::string(const std::string&)>& rename) {
  const auto below = [&](const Expr& child) { return shift(child, k, rename); };
  if (const Local* l = as<Local>(e)) return local(rename(l->name));
  if (const Access* a = as<Access>(e)) return access(a->field, moved(a->offset, k));
  if (const Inside* i = as<Inside>(e)) return inside(moved(i->offset, k), i->grow);
  if (const Interp* i = as<Interp>(e)) {
    return interp({i->field, moved(i->offset, k), map_all(i->displacement, below), i->along});
  }
  return map_children(e, below);
}

Expr substitute_params(const Expr& e, const std::map<std::string, Expr>& values) {
  if (const Param* p = as<Param>(e)) {
    const auto found = values.find(p->name);
    return found == values.end() ? e : found->second;
  }
  return map_children(e, [&](const Expr& child) { return substitute_params(child, values); });
}

Expr rename_fields(const Expr& e, const std::function<std::string(const std::string&)>& rename) {
  const auto below = [&](const Expr& child) { return rename_fields(child, rename); };
  if (const Access* a = as<Access>(e)) return access(rename(a->field), a->offset);
  if (const Interp* i = as<Interp>(e)) {
    return interp({rename(i->field), i->offset, map_all(i->displacement, below), i->along});
  }
  return map_children(e, below);
}

bool reads_param(const Expr& e, const std::string& name) {
  return any_part(e, [&](const Expr& part) {
    const Param* param = as<Param>(part);
    return param != nullptr && param->name == name;
  });
}

}  // namespace dpde::stencil
