// SPDX-License-Identifier: Apache-2.0
// Text output of the LLVM back end: `dpde emit --stage llvm` and `--stage asm`. Text before optimisation does not
// depend on the machine; the others are for the host processor.
#pragma once

#include <string>
#include <vector>

#include "codegen/llvm/jit_options.h"
#include "loop/loop.h"

namespace dpde::codegen {

std::string emit_llvm(const loop::Module& module, bool optimised, const JitOptions& options = {});
std::string emit_assembly(const loop::Module& module, const JitOptions& options = {});

/// Rows whose optimised code has no vector arithmetic, i.e. was not vectorised.
std::vector<std::string> scalar_rows(const loop::Module& module, const JitOptions& options = {});

}  // namespace dpde::codegen
