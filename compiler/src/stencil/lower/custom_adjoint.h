// SPDX-License-Identifier: Apache-2.0
// Adjoints that a person gives: what their formulas may be, and how they fall apart by the points whose seeds they
// hold.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include "stencil/stencil.h"
#include "support/names/derivative_names.h"

namespace dpde::stencil {

/// The field that `kernel` stores, or the sum, whose seed has this name; nullptr for other names. The seed of a sum is
/// the same number at all points, but is read like a field's: s_bar[+1] stands beside what the point at +1 adds.
const std::string* seeded_by(const Kernel& kernel, const std::string& name);
const CustomAdjoint* find_custom_adjoint(const Kernel& kernel, const std::string& input);

/// A formula as a sum: the terms that hold seeds at the point displaced by k, for each k.
std::map<Offset, Expr> terms_by_seed(const Kernel& kernel, const Expr& formula);

struct CustomAdjointViolation {
  std::string what;  // behind "the adjoint that is given for u of slope"
  std::string hint;
};
/// Why no transpose has this formula; what remains is told from one by numbers (adjoint/check/custom_adjoint_check.h).
std::optional<CustomAdjointViolation> find_problem(const Kernel& kernel, const CustomAdjoint& given);

/// Without the formulas of what the kernel does not read.
Kernel without_idle_formulas(Kernel kernel);
/// Without the stores to other than these fields, and their seeds.
Kernel with_stores_only(Kernel kernel, const std::set<std::string>& fields);

}  // namespace dpde::stencil
