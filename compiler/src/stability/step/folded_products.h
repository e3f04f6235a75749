// SPDX-License-Identifier: Apache-2.0
// Aliasing of products in Fourier series: waves too short for the grid fold back to longer ones (S. A. Orszag, J.
// Atmos. Sci. 28 (1971) 1074). The derivative of an aliased product has a large error: a bracket's largest stable step
// falls as the square of the cells. Frozen coefficients cause no aliasing. Runs of the step's tangent on the scene's
// own grid show it, see coupled_means.h.
#pragma once

#include <string>

#include "model/model.h"
#include "stability/state_groups.h"

namespace dpde::stability {

struct StabilityReport;

/// Whether equations of the group multiply fields by spectral derivatives or take spectral derivatives of products,
/// without dealiasing.
bool folds_products(const model::Problem& problem, const StateGroup& group);

/// The remedy if aliasing sets the verdict, or may; "": it does not, or there is no remedy.
std::string folding_text(const model::Problem& problem, const StabilityReport& verdict);

}  // namespace dpde::stability
