// SPDX-License-Identifier: Apache-2.0
// One hand-written kernel: ast to stencil.
#pragma once

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

struct KernelRead {
  Kernel kernel;            // rank 1 where nothing tells
  bool rank_known = false;  // by an offset, by interp or by `on 2 axes`
  bool good = true;         // nothing was reported
};

KernelRead read_kernel(const ast::Kernel& source, DiagnosticSink& sink);

}  // namespace dpde::stencil
