// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: the verified IR of a whole module, before it is bound to a processor.
#pragma once

#include <llvm/IR/Module.h>

#include <memory>
#include <string>
#include <vector>

#include "loop/loop.h"

namespace dpde::codegen {

/// Symbol with a prefix, so that a row cannot replace a C library function of the same name.
std::string row_symbol(const std::string& row);
/// void(const double* params, double* uniforms)
std::string uniforms_symbol();
/// Function that computes only the uniforms that depend on the step number, if the module has such uniforms.
std::string counted_symbol();

/// Name of the argument that points to a stream's line: u, u_yp1 (the row above), u_ym1_zp2 ...
std::string line_name(const loop::Stream& stream);

/// Alternative code for a row.
struct RowVariant {
  std::string suffix;    // of the symbol; "": the row itself
  int vector_width = 0;  // bits; 0: width of the module
  bool streams = false;  // stores bypass the caches
  bool ahead = false;    // reads are prefetched
};
/// Attribute of functions whose vector stores bypass the caches (optimise.cpp).
inline constexpr const char* streaming_attribute = "dpde-streams";

/// Whether the row may have variants: only rows without sums and scatters, since their values do not depend on the
/// order of cells.
bool may_vary(const loop::Row& row);

std::unique_ptr<llvm::Module> emit_module(const loop::Module& module, llvm::LLVMContext& context,
                                          const std::vector<RowVariant>& variants = {});

/// Adds the function of one row (emit_row.cpp).
void emit_row(const loop::Module& module, const loop::Row& row, llvm::Module& out, const RowVariant& variant = {});

}  // namespace dpde::codegen
