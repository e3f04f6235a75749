// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: neighbours along a row from registers. After the vectoriser u[i-1], u[i], u[i+1] are three
// loads, two of which cross cache lines. On processors whose vectors fill a cache line, such a load costs twice as
// much. This pass loads each cache line once, keeps it for the next iteration, and shifts neighbours together from two
// such vectors.
#pragma once

#include <llvm/IR/PassManager.h>

namespace dpde::codegen {

/// Attribute of a pointer to a line of memory: its position along x, in cells from the row's first cell. Rows begin on
/// cache lines, and all of a cache line may be read if any of it is used (layout.h).
inline constexpr const char* line_start_attribute = "dpde-line-start";
/// Attribute of the line of each field that is first to reach new memory, in rows that prefetch.
inline constexpr const char* leading_attribute = "dpde-leading";

/// Changes loops of one block whose vectors fill cache lines; all values stay the same. Leading lines are prefetched:
/// with few loads in an iteration many iterations run concurrently, and the hardware prefetcher, which stops at every
/// page, falls behind (2-D Burgers, 1024^2, Zen 5: 1.07 times the original time without prefetch, 0.89 times with it).
class LineLoads : public llvm::PassInfoMixin<LineLoads> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses);
  static bool isRequired() { return true; }
};

}  // namespace dpde::codegen
