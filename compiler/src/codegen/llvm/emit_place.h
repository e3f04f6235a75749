// SPDX-License-Identifier: Apache-2.0
// Private to codegen/llvm: code that depends on the cell's position - inside, interp and scatter (semantics:
// stencil.h). It has no branches. Addresses lie inside the field for every displacement, also NaN and 1e300. Weights
// use the displacement unchanged, so a displacement that is not finite gives NaN.
#pragma once

#include <llvm/IR/IRBuilder.h>

#include <array>
#include <vector>

#include "loop/loop.h"

namespace dpde::codegen {

/// Largest number of values to which the scatters of a row add for one cell.
int places_of_scatters(const loop::Row& row);

class PlaceEmitter {
 public:
  /// Arguments of a row function that give the row's position.
  struct Row {
    llvm::Value* first = nullptr;
    llvm::Value* y = nullptr;
    llvm::Value* z = nullptr;
    llvm::Value* layout = nullptr;
    std::vector<llvm::Value*> grids;
  };

  /// `before` emits loop-invariant code before the loop. `body` emits inside the loop, where `index` is the cell's
  /// number in the row. Positions and weights are of type `real`; cell numbers are exact in both precisions.
  PlaceEmitter(const loop::Row& row, Row values, llvm::Type* real, llvm::IRBuilder<>& before, llvm::IRBuilder<>& body,
               llvm::Value* index);

  llvm::Value* inside(const loop::Inside& inside);
  llvm::Value* interp(const loop::Interp& interp, const std::vector<llvm::Value*>& displacement);
  /// One contribution of a scatter; `element` is the offset from cell 0 of its grid.
  struct Share {
    llvm::Value* element;
    llvm::Value* value;
  };
  std::vector<Share> scatter(const loop::Interp& target, const std::vector<llvm::Value*>& displacement,
                             llvm::Value* value);

 private:
  /// A cell along one axis in an interpolation: offset from cell 0 in elements, and weight.
  struct Tap {
    llvm::Value* element = nullptr;
    llvm::Value* weight = nullptr;
  };
  using Taps = std::vector<Tap>;
  /// Position of a displaced point along one axis.
  struct Spot {
    std::array<llvm::Value*, 4> cells;  // from the second one below the point to the second one above
    llvm::Value* fraction;              // position between cells[1] (0) and cells[2] (1)
    llvm::Value* rate;                  // d fraction / d displacement: 0 where clamped, else 1
  };
  Spot spot(int axis, int offset, llvm::Value* displacement);
  void set_periodic_cells(int axis, llvm::Value* low_cell, Spot& spot);
  void set_bounded_cells(int axis, llvm::Value* low_cell, Spot& spot);
  llvm::Value* polynomial(const std::array<double, 4>& coefficients, llvm::Value* x);
  Taps weigh(const Spot& spot, InterpolationBasis along);
  std::vector<Taps> taps(const loop::Interp& interp, const std::vector<llvm::Value*>& displacement);
  llvm::Value* moved(llvm::Value* element, const Tap& tap);
  llvm::Value* gather(const std::vector<Taps>& taps, int axis, llvm::Value* element, llvm::Value* base);
  void spread(const std::vector<Taps>& taps, int axis, llvm::Value* element, llvm::Value* share,
              std::vector<Share>& shares);

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
