// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/transforms.h"

#include <algorithm>

#include "adjoint/reverse/weights.h"
#include "stencil/analyse/symbol.h"
#include "support/contains.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

Expr slope_by(const Expr& symbol, const std::string& param) {
  const Slopes slopes = slopes_of(symbol, Varied{{}, {param}, {}});
  return slopes.empty() ? Expr(0.0) : slopes.front().second;
}

/// dM/dp times `rate`.
std::vector<Multiplier> derivative_by(const Multiplier& by, const std::string& param, const Expr& rate) {
  const Expr of_factor = slope_by(by.factor, param),
             of_argument = by.function ? slope_by(by.argument, param) : Expr(0.0);
  std::vector<Multiplier> result;
  const auto add = [&](WaveFunction function, const Expr& factor) {
    if (!is_literal(factor, 0)) result.push_back({function, by.argument, factor, by.within_two_thirds});
  };
  const auto [kind, number] = by.function;  // the argument of heaviside has no params
  add(by.function, rate * (kind == WaveFunction::Kind::phi ? of_argument * by.factor + of_factor : of_factor));
  if (number > 0) add({kind, number + 1}, rate * (-(static_cast<double>(number) * of_argument * by.factor)));
  return result;
}

std::vector<std::string> varied_params(const Transform& transform, const Varied& varied) {
  std::vector<std::string> params = params_of(transform);
  std::erase_if(params, [&](const std::string& name) { return !varied.params.contains(name); });
  return params;
}

/// The terms of the derivative by one parameter.
std::vector<Transform::Term> terms_by(const Transform& transform, const std::string& param, const Expr& rate) {
  std::vector<Transform::Term> terms;
  for (const Transform::Term& term : transform.terms) {
    for (Multiplier& by : derivative_by(term.by, param, rate)) terms.push_back({term.field, std::move(by)});
  }
  return terms;
}

}  // namespace

bool is_varied(const Transform& transform, const Varied& varied) {
  const auto varies = [&](const Transform::Term& term) { return varied.fields.contains(term.field); };
  return std::ranges::any_of(transform.terms, varies) || !varied_params(transform, varied).empty();
}

void add_tangent_of(const Transform& transform, const Varied& varied, const Writing& into) {
  if (!varied.fields.contains(transform.result)) return;
  Transform rate{{}, into.names.of(transform.result)};
  for (const Transform::Term& term : transform.terms) {
    if (varied.fields.contains(term.field)) rate.terms.push_back({into.names.of(term.field), term.by});
  }
  for (const std::string& name : varied_params(transform, varied)) {
    for (Transform::Term& term : terms_by(transform, name, param(into.names.of(name)))) rate.terms.push_back(term);
  }
  if (rate.terms.empty()) return add_store(rate.result, 0.0, "still", into);  // varies by later additions only
  into.body.push_back(std::move(rate));
}

std::vector<Transform> transposes_of(const Transform& transform, const std::string& seed, const Varied& varied) {
  std::vector<Transform> all;
  for (const Transform::Term& term : transform.terms) {
    if (!varied.fields.contains(term.field)) continue;
    auto known = std::ranges::find(all, term.field, &Transform::result);
    if (known == all.end()) known = all.insert(all.end(), Transform{{}, term.field});
    known->terms.push_back({seed, transposed(term.by)});
  }
  return all;
}

std::vector<std::pair<std::string, Transform>> slopes_of(const Transform& transform, const Varied& varied) {
  std::vector<std::pair<std::string, Transform>> slopes;
  for (const std::string& name : varied_params(transform, varied)) {
    Transform slope{terms_by(transform, name, 1.0), ""};
    if (!slope.terms.empty()) slopes.emplace_back(name, std::move(slope));
  }
  return slopes;
}

}  // namespace dpde::adjoint
