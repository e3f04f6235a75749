// SPDX-License-Identifier: Apache-2.0
// Stencil level -> loop level: streams, uniforms and the schedule of fills.
//
//  - An expression of parameters and numbers becomes a uniform, once per module. Products and quotients are regrouped
//    so that their uniform factors form one uniform: nu*(u[-1] - 2*u + u[+1])/hx^2 -> u0*(...), u0 = nu/hx^2.
//  - Kernels that differ in names and numbers only become one row (share_rows.h).
//  - Fills of inputs run once, in `prepare`; the body fills the fields that the next step reads (see Program::prepare).
//    A fill of a field that a sweep has just written is part of that sweep.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "loop/loop.h"
#include "stencil/stencil.h"

namespace dpde::loop {

/// Known values of parameters.
using ParamValues = std::map<std::string, double>;

/// The module must have passed stencil::verify and contain the programs. `values` determine the magnitude of uniforms:
/// in rows of floats a uniform out of range is split into several numbers (Factors::varying).
Module from_stencil(const stencil::Module& module, const std::vector<std::string>& programs,
                    Precision real = Precision::f64, const ParamValues& values = {});

}  // namespace dpde::loop
