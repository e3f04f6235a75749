// SPDX-License-Identifier: Apache-2.0
// Custom adjoints: checks of the user's formulas, and their decomposition by the points whose seeds they contain.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include "stencil/stencil.h"
#include "support/names/derivative_names.h"

namespace dpde::stencil {

/// The stored field, or the sum, of `kernel` whose seed has this name; nullptr for other names. The seed of a sum is
/// uniform but is read like a field's: s_bar[+1] belongs to the contribution of the point at +1.
const std::string* seeded_by(const Kernel& kernel, const std::string& name);
const CustomAdjoint* find_custom_adjoint(const Kernel& kernel, const std::string& input);

/// Splits a formula into sums by seeds: for each k the terms with seeds at the point displaced by k.
std::map<Offset, Expr> terms_by_seed(const Kernel& kernel, const Expr& formula);

struct CustomAdjointViolation {
  std::string what;  // continues "the adjoint that is given for u of slope"
  std::string hint;
};
/// A reason why the formula cannot be a transpose. Other wrong formulas are found numerically
/// (adjoint/check/custom_adjoint_check.h).
std::optional<CustomAdjointViolation> find_problem(const Kernel& kernel, const CustomAdjoint& given);

/// The kernel without adjoint formulas of inputs that it does not read.
Kernel without_idle_formulas(Kernel kernel);
/// The kernel with stores to `fields` only, without the other fields' seeds.
Kernel with_stores_only(Kernel kernel, const std::set<std::string>& fields);

}  // namespace dpde::stencil
