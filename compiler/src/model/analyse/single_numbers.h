// SPDX-License-Identifier: Apache-2.0
// Numbers in formulas that single-precision fields cannot represent: as a float 1e-60 is 0 and 1e39 infinite, so
// gradients would be silently wrong.
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::model {

/// Reports an error at each number, or formula of numbers and parameters, that is combined with a field and is no
/// float. A factor may be any ratio of two floats: the loop level multiplies by powers with half its exponent
/// (loop::Factors::varying). Uniform values are computed in double precision.
void check_numbers_of_floats(const Problem& problem, DiagnosticSink& sink);

}  // namespace dpde::model
