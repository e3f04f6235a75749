// SPDX-License-Identifier: Apache-2.0
// The LLVM back end as text: what `dpde emit --stage llvm` and `--stage asm` print.
// Text before optimisation does not depend on the machine; the others are for the processor this runs on.
#pragma once

#include <string>
#include <vector>

#include "codegen/llvm/jit_options.h"
#include "loop/loop.h"

namespace dpde::codegen {

std::string emit_llvm(const loop::Module& module, bool optimised, const JitOptions& options = {});
std::string emit_assembly(const loop::Module& module, const JitOptions& options = {});

/// The rows whose optimised code does no arithmetic on vectors: what the vectoriser has refused.
std::vector<std::string> scalar_rows(const loop::Module& module, const JitOptions& options = {});

}  // namespace dpde::codegen
