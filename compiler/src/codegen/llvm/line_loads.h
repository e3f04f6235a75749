// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: neighbours along a row out of registers. After the vectoriser u[i-1], u[i], u[i+1] are three
// loads, two of which cross cache lines; on processors whose vectors are as long as a line each of those costs two.
// Here a line of memory is loaded once, kept for the next round of the loop, and its neighbours are shifted together
// out of two such vectors.
#pragma once

#include <llvm/IR/PassManager.h>

namespace dpde::codegen {

/// Attribute of a pointer to a line of memory: the place along x, in cells from the first of the row, where it points.
/// Rows begin on cache lines, and memory may be read to the ends of the lines that hold what is used (layout.h).
inline constexpr const char* line_start_attribute = "dpde-line-start";
/// Attribute of the lines that are the first of their field to come to new memory, in rows that fetch early.
inline constexpr const char* leading_attribute = "dpde-leading";

/// Changes loops of one block whose vectors fill cache lines; all values stay the same. Leading lines are fetched
/// early: with few loads in a round many rounds are under way at once, and the processor's own prefetching, which ends
/// with every page, falls behind (2-D Burgers, 1024^2, Zen 5: without it 1.07 times as long as with all the loads, with
/// it 0.89 times).
class LineLoads : public llvm::PassInfoMixin<LineLoads> {
 public:
  llvm::PreservedAnalyses run(llvm::Function& function, llvm::FunctionAnalysisManager& analyses);
  static bool isRequired() { return true; }
};

}  // namespace dpde::codegen
