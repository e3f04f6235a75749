// SPDX-License-Identifier: Apache-2.0
// Numbers of formulas that fields in single precision cannot hold: in a float 1e-60 is 0 and 1e39 infinite, and
// gradients would be wrong without a word.
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::model {

/// An error at each number, or formula of numbers and parameters, that meets a field and is no float. Factors may be as
/// large or small as what makes a float of a float: the loop level multiplies by halves of their exponents
/// (loop::Factors::varying). What is the same at all points is computed in double precision.
void check_numbers_of_floats(const Problem& problem, DiagnosticSink& sink);

}  // namespace dpde::model
