// SPDX-License-Identifier: Apache-2.0
// What a caller of the LLVM back end may choose.
#pragma once

namespace dpde::codegen {

/// Quick code is compiled in a part of the time, for rows that run for less than that: but for sums it goes cell by
/// cell, and every value has a place in memory. Products are fused and sums are taken as they always are: results are
/// the same to the last bit, but for products by numbers where a vector has another form of them, as in cells that fill
/// none.
enum class Effort { full, quick };

struct JitOptions {
  int vector_width = 0;   // bits: 128, 256 or 512; 0 = chosen for the host
  bool variants = false;  // rows get the other code of dpde_kernel.variants, to choose from by measurement
  Effort effort = Effort::full;
  /// Quotients may be products by reciprocals, which several share: they change by rounding, and a vector of them takes
  /// as long as twenty products.
  bool reciprocals = false;
};

}  // namespace dpde::codegen
