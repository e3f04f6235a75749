// SPDX-License-Identifier: Apache-2.0
#include "stability/step/folded_products.h"

#include <algorithm>

#include "model/build.h"
#include "model/uses.h"
#include "stability/stability_report.h"
#include "support/assert.h"

namespace dpde::stability {

namespace {

bool varies(const model::Expr& e) { return holds_any<model::Field, model::Coordinate>(e); }

bool is_product(const model::Expr& e) {
  if (const auto* call = as<model::Call>(e)) return std::ranges::any_of(call->arguments, varies);
  const auto* binary = as<model::Binary>(e);
  if (binary == nullptr) return false;
  switch (binary->op) {
    case BinaryOp::multiply: return varies(binary->left) && varies(binary->right);
    case BinaryOp::divide: return varies(binary->right);
    case BinaryOp::power: return varies(binary->left) || varies(binary->right);
    case BinaryOp::add:
    case BinaryOp::subtract:
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return false;
  }
  unreachable("operator");
}

/// Solutions of solves do not count: they are smooth, whatever the derivatives in their equations are.
bool has_series(const model::Scheme& scheme, const model::Expr& e) {
  if (is<model::Solve>(e)) return false;
  return model::is_spectral(scheme, e) ||
         any_child(e, [&](const model::Expr& part) { return has_series(scheme, part); });
}

bool folds(const model::Scheme& scheme, const model::Expr& e) {
  if (const auto* advect = as<model::Advect>(e))
    return model::is_spectral(scheme, e) && std::ranges::any_of(advect->velocity, varies);
  if (const auto* derivative = as<model::Derivative>(e))
    return model::is_spectral(scheme, e) && any_part(derivative->operand, is_product);
  return is_product(e) && has_series(scheme, e);
}

}  // namespace

bool folds_products(const model::Problem& problem, const StateGroup& group) {
  if (problem.scheme.dealias || !problem.program.empty()) return false;
  const auto is_folded = [&](const model::Expr& e) { return folds(problem.scheme, e); };
  return model::any_formula(problem, [&](const model::Use& use) {
    const bool is_cut = model::makes_state(use.kind) && use.kind != model::UseKind::event;  // where waves can be
    return is_cut && is_in(group, use.owner) && any_part(use.formula, is_folded);
  });
}

std::string folding_text(const model::Problem& problem, const StabilityReport& verdict) {
  const bool has_parts = std::ranges::any_of(problem.states, [](const model::State& s) { return s.parts > 1; });
  const bool may_be_set_by_it = verdict.is_of_means || verdict.short_waves || verdict.leaves_out_folding();
  if (!may_be_set_by_it || has_parts || !folds_products(problem, verdict.group)) return "";
  return "dealias = two_thirds in the scheme cuts the waves that products fold back; without it stable steps become "
         "shorter as waves spread";
}

}  // namespace dpde::stability
