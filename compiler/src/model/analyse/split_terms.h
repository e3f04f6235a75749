// SPDX-License-Identifier: Apache-2.0
// The parts that a split step takes one behind the other.
#pragma once

#include "model/model.h"

namespace dpde::model {

/// Of the `rate` of a state: the terms with an advect, those that implicit time schemes solve for
/// (model/analyse/implicit_part.h), or all others.
Expr terms_for(const Problem& problem, const std::string& state, const Expr& rate, Split::Terms terms);

}  // namespace dpde::model
