// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <utility>

#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

using ValuesOfLocals = std::map<std::string, Expr>;

/// Rebuilds `e` from the leaves up, with the locals in `values` replaced.
Expr rebuild(const Expr& e, const ValuesOfLocals& values) {
  if (const Local* l = as<Local>(e)) {
    const auto found = values.find(l->name);
    return found == values.end() ? e : found->second;
  }
  return map_children(e, [&](const Expr& child) { return rebuild(child, values); });
}

bool is_trivial(const Expr& e) { return is<Literal, Param, Local>(e); }

Kernel simplify_kernel(const Kernel& kernel) {
  Kernel result = kernel;
  result.lets.clear();
  ValuesOfLocals values;
  for (const Let& let : kernel.lets) {
    const Expr value = rebuild(let.value, values);
    if (is_trivial(value)) {
      values.emplace(let.name, value);
    } else {
      result.lets.push_back({let.name, value});
    }
  }
  result = map_expressions(result, [&](const Expr& e) { return rebuild(e, values); });
  std::erase_if(result.stores, [&](const Store& store) {
    return result.custom_adjoints.empty() && store.accumulate && is_literal(store.value, 0);
  });
  std::erase_if(result.scatters, [](const Scatter& scatter) { return is_literal(scatter.value, 0); });
  return result;
}

void simplify_sides(std::vector<AxisBoundary>& axes) {
  axes = map_sides(std::move(axes), [](const Expr& e) { return rebuild(e, {}); });
}

void simplify_statements(std::vector<Statement>& statements) {
  for_each_statement(statements, [](Statement& statement) {
    match(
        statement, [](OneOf<Fill, Fold> auto& halo) { simplify_sides(halo.axes); },
        [](Transform& transform) {
          for (Transform::Term& term : transform.terms) {
            term.by.argument = rebuild(term.by.argument, {});
            term.by.factor = rebuild(term.by.factor, {});
          }
        },
        ignored<Reduce, NetworkCall, Run, Solve, Repeat>);
  });
}

}  // namespace

Module simplify(const Module& module) {
  Module result = module;
  for (Kernel& kernel : result.kernels) kernel = simplify_kernel(kernel);
  for (Program& program : result.programs) simplify_statements(program.body);
  return result;
}

}  // namespace dpde::stencil
