// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "source/diagnostic.h"
#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// Reports solves that are differentiated through their iterations and whose operator is not symmetric.
void check_iterations(const Lowering& lowering, DiagnosticSink& sink);

}  // namespace dpde::stencil
