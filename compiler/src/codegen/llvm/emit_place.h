// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: all that depends on where a cell lies - inside, interp and scatter (semantics: stencil.h).
// The code has no branches. Addresses lie inside the field for every displacement, NaN and 1e300 included, while
// weights are computed with the displacement as it is: one that is not finite gives NaN.
#pragma once

#include <llvm/IR/IRBuilder.h>

#include <array>
#include <vector>

#include "loop/loop.h"

namespace dpde::codegen {

class PlaceEmitter {
 public:
  /// The arguments of a row function that say where the row is.
  struct Row {
    llvm::Value* first = nullptr;
    llvm::Value* y = nullptr;
    llvm::Value* z = nullptr;
    llvm::Value* layout = nullptr;
    std::vector<llvm::Value*> grids;
  };

  /// `before` adds what is the same for all cells in front of the loop; `body` is inside it, where the cell is
  /// number `index` of the row. Places and weights are computed as `real`; numbers of cells are exact in either precision.
  PlaceEmitter(const loop::Row& row, Row values, llvm::Type* real, llvm::IRBuilder<>& before, llvm::IRBuilder<>& body,
               llvm::Value* index);

  llvm::Value* inside(const loop::Inside& inside);
  llvm::Value* interp(const loop::Interp& interp, const std::vector<llvm::Value*>& displacement);
  void scatter(const loop::Interp& target, const std::vector<llvm::Value*>& displacement, llvm::Value* value);

 private:
  /// The two cells along one axis between which is interpolated: distance from cell 0 in elements, and weight.
  struct Pair {
    std::array<llvm::Value*, 2> element{}, weight{};
  };
  struct Spot {
    llvm::Value* low_cell;  // a real, possibly not finite
    llvm::Value* fraction;
    llvm::Value* clamped;  // null along periodic axes
  };
  Pair pair(int axis, int offset, llvm::Value* displacement, bool slope);
  std::vector<Pair> pairs(const loop::Interp& interp, const std::vector<llvm::Value*>& displacement);
  Pair weigh(const Spot& spot, bool slope);
  llvm::Value* element_pointer(const std::vector<Pair>& pairs, int corner, llvm::Value* base);
  llvm::Value* gather(const std::vector<Pair>& pairs, int axis, int corner, llvm::Value* base);

  llvm::Value* cell(int axis, int offset);
  llvm::Value* cell_as_real(int axis, int offset);
  llvm::Value* between(llvm::Value* cell, llvm::Value* low, llvm::Value* high);
  llvm::Value* layout_entry(int member, int axis);
  llvm::Value* cells(int axis);
  llvm::Value* cells_as_real(int axis);
  llvm::Value* stride(int axis);
  llvm::Value* real(double value) const;
  llvm::Align alignment() const { return llvm::Align(real_->getPrimitiveSizeInBits() / 8); }

  const loop::Row& row_;
  Row values_;
  llvm::Type* real_;
  llvm::IRBuilder<>& before_;
  llvm::IRBuilder<>& body_;
  llvm::Value* index_;
  std::array<llvm::Value*, loop::max_rank> cells_{}, cells_as_real_{}, stride_{};
};

}  // namespace dpde::codegen
