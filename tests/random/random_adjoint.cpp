// SPDX-License-Identifier: Apache-2.0
#include "random/random_adjoint.h"

#include <algorithm>
#include <map>
#include <optional>

#include "adjoint/adjoint.h"
#include "random/random_expression.h"
#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"

namespace dpde::testing {

using namespace stencil;

namespace {

constexpr int longest_formula = 200;  // nodes

/// Inside and interpolation are no part of formulas that hold away from walls.
bool may_have_formula(const Kernel& kernel) {
  return kernel.sums.empty() && kernel.scatters.empty() && !any_part(kernel, [](const Expr& e) {
           const Access* read = as<Access>(e);
           return (read && is_coordinate(read->field) && read->offset != Offset{}) || is<Inside, Interp>(e);
         });
}

/// A program with the kernel alone, on periodic axes.
Module lone_program(const Kernel& kernel) {
  Program program{"p", std::vector<Topology>(static_cast<std::size_t>(kernel.rank), Topology::periodic), {}, {}, {}};
  Kernel begin{"begin", kernel.rank, {}, {}, {}, {}};
  for (const Signature::Read& read : signature(kernel).reads) {
    if (!is_coordinate(read.field))
      program.body.push_back(Fill{read.field, std::vector<AxisBoundary>(program.axes.size())});
  }
  for (const Store& store : kernel.stores) {
    if (store.accumulate) begin.stores.push_back({store.field, false, 0.0, {}});
    program.keeps.push_back(store.field);
  }
  if (!begin.stores.empty()) program.body.push_back(Run{begin.name});
  program.body.push_back(Run{kernel.name});
  return {{begin, kernel}, {program}, {}};
}

Expr without_locals(const Expr& e, const std::map<std::string, Expr>& values) {
  if (const Local* l = as<Local>(e)) return values.at(l->name);
  return map_children(e, [&](const Expr& child) { return without_locals(child, values); });
}

/// The one value that the derived program stores or adds up, with its lets written out.
std::optional<Expr> derived_formula(const Kernel& kernel, const std::string& input, bool is_param) {
  const Module module = lone_program(kernel);
  DiagnosticSink sink;
  const adjoint::Activity by_input = is_param ? adjoint::Activity{{}, {input}} : adjoint::Activity{{input}, {}};
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", by_input, sink);
  if (sink.has_errors()) return std::nullopt;
  for (const Store& store : kernel.stores) {
    const std::string* const seed = derived.field(store.field);
    if (seed != nullptr && *seed != bar_of(store.field)) return std::nullopt;
  }
  if (derived.module.kernels.size() != 1) return std::nullopt;
  const Kernel& gather = derived.module.kernels[0];
  std::map<std::string, Expr> values;
  for (const Let& let : gather.lets) {
    values.emplace(let.name, without_locals(let.value, values));
    if (node_count(values.at(let.name)) > longest_formula) return std::nullopt;
  }
  const bool is_one = gather.scatters.empty() && gather.stores.size() + gather.sums.size() == 1;
  if (!is_one) return std::nullopt;
  const Expr formula = without_locals(is_param ? gather.sums[0].value : gather.stores[0].value, values);
  return node_count(formula) > longest_formula || is<Literal>(formula) ? std::nullopt : std::optional(formula);
}

Expr with_factors_exchanged(const Expr& e) {
  const Expr inner = map_children(e, with_factors_exchanged);
  const Binary* b = as<Binary>(inner);
  return b && b->op == BinaryOp::multiply ? b->right * b->left : inner;
}

Expr rewritten(const Expr& formula, SplitMix& random) {
  switch (random.below(5)) {
    case 0: return 2.0 * formula - formula;
    case 1: return formula * 3.0 / 3.0;
    case 2: return -(-formula);
    case 3: return with_factors_exchanged(formula);
    default: return formula;
  }
}

}  // namespace

void give_adjoint(Kernel& kernel, SplitMix& random, bool is_wrong) {
  if (!may_have_formula(kernel)) return;
  const Signature s = signature(kernel);
  std::vector<std::string> inputs;
  for (const Signature::Read& read : s.reads) {
    const bool is_target = std::ranges::find(s.updates, read.field) != s.updates.end();
    if (!is_coordinate(read.field) && !is_target) inputs.push_back(read.field);
  }
  const std::size_t fields = inputs.size();
  for (const char* param : {"a", "nu"}) {
    if (std::ranges::find(s.params, param) != s.params.end()) inputs.push_back(param);
  }
  if (inputs.empty()) return;
  const auto chosen = static_cast<std::size_t>(random.below(static_cast<int>(inputs.size())));
  const std::optional<Expr> formula = derived_formula(kernel, inputs[chosen], chosen >= fields);
  if (!formula) return;
  const Expr value = is_wrong ? 1.25 * *formula : rewritten(*formula, random);
  const CustomAdjoint given{inputs[chosen], value, {}};
  if (!find_problem(kernel, given)) kernel.custom_adjoints.push_back(given);
}

}  // namespace dpde::testing
