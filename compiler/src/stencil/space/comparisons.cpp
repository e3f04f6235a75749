// SPDX-License-Identifier: Apache-2.0
#include "stencil/space/comparisons.h"

#include "stencil/build.h"

namespace dpde::stencil {

namespace {

void add_locals(const Expr& e, std::set<std::string>& locals) {
  visit(e, [&](const Expr& part) {
    if (const Local* local = as<Local>(part)) locals.insert(local->name);
  });
}

void add_decisive(const Expr& e, std::set<std::string>& locals) {
  visit(e, [&](const Expr& part) {
    if (!is_decision(part)) return;
    for_each_child(part, [&](const Expr& operand) { add_locals(operand, locals); });
  });
}

}  // namespace

bool is_decision(const Expr& e) {
  if (is<Interp>(e)) return true;
  if (const Binary* b = as<Binary>(e)) return precedence(b->op) == precedence(BinaryOp::less);
  const Call* call = as<Call>(e);
  return call && has_jumps(call->fn);
}

std::set<std::string> decisive_lets(const Kernel& kernel) {
  std::set<std::string> locals;
  for (const Store& store : kernel.stores) add_decisive(store.value, locals);
  for (const Sum& sum : kernel.sums) add_decisive(sum.value, locals);
  for (const Scatter& scatter : kernel.scatters) {
    add_decisive(scatter.value, locals);
    add_decisive(interp(scatter.target), locals);
  }
  for (auto let = kernel.lets.rbegin(); let != kernel.lets.rend(); ++let) {
    add_decisive(let->value, locals);
    if (locals.contains(let->name)) add_locals(let->value, locals);
  }
  return locals;
}

}  // namespace dpde::stencil
