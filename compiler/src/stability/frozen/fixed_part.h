// SPDX-License-Identifier: Apache-2.0
// Splits a step's tangent. It is repeated with the same fields and changing perturbations, so the results that depend
// on these fields alone, as the stages of the states, are computed once.
#pragma once

#include <set>
#include <string>

#include "stencil/stencil.h"

namespace dpde::stability {

struct ApartModule {
  stencil::Module module;  // its first program is the tangent without the fixed part, whose results are its inputs
  std::string fixed;       // the program of the fixed part; "": there is none
};

/// `perturbations`: the fields that change between runs of the module's first program.
ApartModule with_fixed_part_apart(stencil::Module module, const std::set<std::string>& perturbations);

}  // namespace dpde::stability
