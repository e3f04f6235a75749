// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: the IR of a whole module, verified, not yet bound to a processor.
#pragma once

#include <llvm/IR/Module.h>

#include <memory>
#include <string>
#include <vector>

#include "loop/loop.h"

namespace dpde::codegen {

/// A row called like a function of the C library must not take its place, hence the prefix.
std::string row_symbol(const std::string& row);
/// void(const double* params, double* uniforms)
std::string uniforms_symbol();
/// Computes those uniforms only that depend on the number of a pass; where the module has such.
std::string counted_symbol();

/// Of the argument that points to a stream's line: u, u_yp1 (the row above), u_ym1_zp2 ...
std::string line_name(const loop::Stream& stream);

/// Other code for the same row.
struct RowVariant {
  std::string suffix;    // of its symbol; "": the row itself
  int vector_width = 0;  // bits; 0: that of the module
  bool streams = false;  // stores go past the caches
  bool ahead = false;    // what is read is fetched early
};
/// Attribute of functions whose vector stores do (optimise.cpp).
inline constexpr const char* streaming_attribute = "dpde-streams";

/// Rows without sums and scatters, whose values do not depend on the order of cells, may have variants.
bool may_vary(const loop::Row& row);

std::unique_ptr<llvm::Module> emit_module(const loop::Module& module, llvm::LLVMContext& context,
                                          const std::vector<RowVariant>& variants = {});

/// Adds the function of one row (emit_row.cpp).
void emit_row(const loop::Module& module, const loop::Row& row, llvm::Module& out, const RowVariant& variant = {});

}  // namespace dpde::codegen
