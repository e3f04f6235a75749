// SPDX-License-Identifier: Apache-2.0
// Stencil level -> loop level: streams, uniforms and the schedule of fills.
//
//  - What depends on parameters and numbers only becomes a uniform, once for the module. Products and quotients are
//    regrouped so that their uniform factors form one uniform: nu*(u[-1] - 2*u + u[+1])/hx^2 -> u0*(...), u0 = nu/hx^2.
//  - Kernels that differ in names and numbers only become one row (share_rows.h).
//  - Fills of inputs run once, in `prepare`; the body fills what the next step reads (see Program::prepare). A fill
//    of a field that a sweep has just written is done with that sweep.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "loop/loop.h"
#include "stencil/stencil.h"

namespace dpde::loop {

/// Values that parameters have, as far as they are known.
using ParamValues = std::map<std::string, double>;

/// The module must have passed stencil::verify and hold the programs. `values`: how large uniforms are, which in rows
/// of floats may be more than one number (Factors::varying).
Module from_stencil(const stencil::Module& module, const std::vector<std::string>& programs,
                    Precision real = Precision::f64, const ParamValues& values = {});

}  // namespace dpde::loop
