// SPDX-License-Identifier: Apache-2.0
// Products of fields by Fourier series: waves too short for the grid fold back to longer ones (S. A. Orszag, J. Atmos.
// Sci. 28 (1971) 1074). A derivative of what is folded is another than that of the product, by so much that a bracket's
// largest stable step falls as the square of the cells. A coefficient that is frozen folds nothing: runs of the step's
// tangent on the scene's own grid see it, see coupled_means.h.
#pragma once

#include <string>

#include "model/model.h"
#include "stability/state_groups.h"

namespace dpde::stability {

struct StabilityReport;

/// Whether equations of the group multiply fields by derivatives that are Fourier series, or take these of products,
/// and nothing cuts what folds back.
bool folds_products(const model::Problem& problem, const StateGroup& group);

/// The cure, where it is what folds back that sets the verdict, or may; "": it does not, or there is none.
std::string folding_text(const model::Problem& problem, const StabilityReport& verdict);

}  // namespace dpde::stability
