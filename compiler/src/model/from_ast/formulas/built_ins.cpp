// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/formulas/built_ins.h"

#include <algorithm>
#include <iterator>

#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/formulas/unit_rules.h"

namespace dpde::model::formulas {

namespace {

constexpr auto needs_derivative = BuiltIn::Needs::points_of_derivative;
constexpr auto nothing = BuiltIn::Needs::nothing;
constexpr bool unsuggested = false;

constexpr BuiltIn table[] = {
    {"dx", along_axis, unit_rules::along_axis, needs_derivative},
    {"dy", along_axis, unit_rules::along_axis, needs_derivative},
    {"dz", along_axis, unit_rules::along_axis, needs_derivative},
    {"d", along_named_axis, unit_rules::along_named_axis, needs_derivative},
    {"lap", laplacian, unit_rules::laplacian, needs_derivative},
    {"grad", gradient, unit_rules::gradient, needs_derivative},
    {"div", divergence, unit_rules::divergence, needs_derivative},
    {"advect", advection, unit_rules::advection, needs_derivative},
    {"bracket", poisson_bracket, unit_rules::poisson_bracket, needs_derivative},
    {"dot", dot_product, unit_rules::product_of_components},
    {"curl", curl, unit_rules::curl, needs_derivative},
    {"norm", norm_call, unit_rules::reduction},
    {"if", choice, unit_rules::choice},
    {"mean", reduction, unit_rules::reduction},
    {"sum", reduction, unit_rules::reduction},
    {"integral", integral, unit_rules::integral},
    {"inject", injection, unit_rules::inject},
    {"sample", sampling, unit_rules::sample},
    {"interpolate", interpolation, unit_rules::operand, BuiltIn::Needs::points},
    {"random_field", random_waves, unit_rules::number},
    {"random_signal", random_waves, unit_rules::number},
    {"noise", white_noise, unit_rules::number},
    {"force_on", force, unit_rules::force},
    {"torque_on", torque, unit_rules::torque},
    {"cross", cross_product, unit_rules::product_of_lists},
    {"outer", outer_product, unit_rules::product_of_lists},
    {"inner", inner_product, unit_rules::product_of_components},
    {"sym", symmetric, unit_rules::turned},
    {"transpose", transpose, unit_rules::turned},
    {"trace", trace, unit_rules::trace},
    {"average", average, unit_rules::operand},
    {"band_pass", band, unit_rules::operand},
    {"sin", elementary, unit_rules::pure_number},
    {"cos", elementary, unit_rules::pure_number},
    {"tan", elementary, unit_rules::pure_number},
    {"asin", elementary, unit_rules::pure_number},
    {"acos", elementary, unit_rules::pure_number},
    {"atan", elementary, unit_rules::pure_number},
    {"atan2", angle, unit_rules::angle},
    {"sinh", elementary, unit_rules::pure_number},
    {"cosh", elementary, unit_rules::pure_number},
    {"tanh", elementary, unit_rules::pure_number},
    {"exp", elementary, unit_rules::pure_number},
    {"log", elementary, unit_rules::pure_number},
    {"erf", elementary, unit_rules::pure_number},
    {"sqrt", elementary, unit_rules::square_root},
    {"abs", elementary, unit_rules::operand},
    {"sign", elementary, unit_rules::sign},
    {"floor", elementary, unit_rules::pure_number},
    {"fraction", elementary, unit_rules::pure_number},
    {"min", extreme, unit_rules::extreme},
    {"max", extreme, unit_rules::extreme},
    {"dt", rate, unit_rules::rate, nothing, unsuggested},
    {"load", load, unit_rules::number, nothing, unsuggested},
};

}  // namespace

const BuiltIn* find_built_in(std::string_view name) {
  const auto* found = std::ranges::find(table, name, &BuiltIn::name);
  return found == std::end(table) ? nullptr : found;
}

std::vector<std::string> function_names() {
  std::vector<std::string> names;
  for (const BuiltIn& row : table) {
    if (row.is_suggested) names.emplace_back(row.name);
  }
  return names;
}

}  // namespace dpde::model::formulas
