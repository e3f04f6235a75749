// SPDX-License-Identifier: Apache-2.0
// Options of the LLVM back end.
#pragma once

namespace dpde::codegen {

/// Quick code compiles much faster, for rows that run for less time than full optimisation takes. Only its sums are
/// vectorised, and every value is in memory. Products are fused and sums are ordered as in full code. So results are
/// the same to the last bit, except products by constants for which vectors have another form; those equal the results
/// of full code in cells that do not fill a vector.
enum class Effort { full, quick };

struct JitOptions {
  int vector_width = 0;   // bits: 128, 256 or 512; 0: chosen for the host
  bool variants = false;  // also compile the alternatives of dpde_kernel.variants, which are compared at run time
  Effort effort = Effort::full;
  /// Divisions may become products by a shared reciprocal. This changes rounding; a vector division takes as long as
  /// twenty products.
  bool reciprocals = false;
};

}  // namespace dpde::codegen
