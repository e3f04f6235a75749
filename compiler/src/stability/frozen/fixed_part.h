// SPDX-License-Identifier: Apache-2.0
// A step's tangent is repeated with the same fields and another perturbation: what it makes of these fields alone, as
// the stages of the states themselves, is the same each time.
#pragma once

#include <set>
#include <string>

#include "stencil/stencil.h"

namespace dpde::stability {

struct ApartModule {
  stencil::Module module;  // its first program is the tangent without the fixed part, whose fields are inputs of it
  std::string fixed;       // the program of the fixed part; "": there is none
};

/// `perturbations`: fields that are others each time the first program of the module runs.
ApartModule with_fixed_part_apart(stencil::Module module, const std::set<std::string>& perturbations);

}  // namespace dpde::stability
