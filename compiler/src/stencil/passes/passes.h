// SPDX-License-Identifier: Apache-2.0
// Passes: verified module in, verified module out, same observable results (swaps, keeps, sums and loops).
// A pass cannot fail. The pipeline runs default_passes before it prints a module, and loop_passes before it generates
// code.
#pragma once

#include <string_view>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Rebuilds every expression through the smart constructors and substitutes lets that are numbers, params or other
/// locals.
Module simplify(const Module& module);

/// Gives expressions that occur more than once in a kernel a let (t1, t2, ...), largest first.
Module eliminate_common_subexpressions(const Module& module);

/// Removes lets, stores, scatters, runs, fills and folds that no result depends on, and kernels whose runs are all
/// removed. Results of a program are its swaps, keeps and sums. Kernels that no program ran before stay.
Module remove_dead_code(const Module& module);

/// Substitutes lets that are used once, and removes unused lets.
Module inline_lets(const Module& module);
Kernel with_lets_inlined(const Kernel& kernel);

/// Multiplies uniform factors into sums all of whose terms have one already. Results change by rounding.
Module distribute_uniforms(const Module& module);

/// Regroups updates u + dt*(...) by neighbour and factors out shared parts. Results change by rounding.
Module regroup_updates(const Module& module);

/// Splits kernels with very many stores. Sums that are divided among the parts change by rounding.
Module split_wide_kernels(const Module& module);

struct Pass {
  std::string_view name;
  Module (*run)(const Module&);
};
inline constexpr Pass default_passes[] = {
    {"simplify", simplify},
    {"cse", eliminate_common_subexpressions},
    {"dead-code", remove_dead_code},
};
inline constexpr Pass loop_passes[] = {
    {"split-wide", split_wide_kernels},
    {"inline-lets", inline_lets},
    {"distribute", distribute_uniforms},
    {"regroup", regroup_updates},
};

}  // namespace dpde::stencil
