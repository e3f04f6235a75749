// SPDX-License-Identifier: Apache-2.0
// One hand-written kernel: ast to stencil.
#pragma once

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

struct KernelRead {
  Kernel kernel;            // rank 1 if unknown
  bool rank_known = false;  // from an offset, interp or `on 2 axes`
  bool good = true;         // nothing was reported
};

KernelRead read_kernel(const ast::Kernel& source, DiagnosticSink& sink);

}  // namespace dpde::stencil
