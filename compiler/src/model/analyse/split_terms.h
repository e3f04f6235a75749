// SPDX-License-Identifier: Apache-2.0
// Terms of the consecutive substeps of a split step.
#pragma once

#include "model/model.h"

namespace dpde::model {

/// Of the right-hand side `rate` of a state: the terms with an advect, those that implicit time schemes solve for
/// (model/analyse/implicit_part.h), or all others.
Expr terms_for(const Problem& problem, const std::string& state, const Expr& rate, Split::Terms terms);

}  // namespace dpde::model
