// SPDX-License-Identifier: Apache-2.0
// Coordinates of cells, and `inside`. emit_interp.cpp has interpolation and scatters.
#include "codegen/llvm/emit_place.h"

#include <cstddef>
#include <utility>

#include "dpde/kernel_abi.h"

namespace dpde::codegen {

PlaceEmitter::PlaceEmitter(const loop::Row& row, Row values, llvm::Type* real, llvm::IRBuilder<>& before,
                           llvm::IRBuilder<>& body, llvm::Value* index)
    : row_(row), values_(std::move(values)), real_(real), before_(before), body_(body), index_(index) {}

llvm::Value* PlaceEmitter::real(double value) const { return llvm::ConstantFP::get(real_, value); }

llvm::Value* PlaceEmitter::layout_entry(int member, int axis) {
  const int byte = member + axis * static_cast<int>(sizeof(int64_t));
  llvm::Value* address = before_.CreateConstInBoundsGEP1_64(before_.getInt8Ty(), values_.layout, byte);
  return before_.CreateAlignedLoad(before_.getInt64Ty(), address, llvm::Align(8));
}

llvm::Value* PlaceEmitter::cells(int axis) {
  llvm::Value*& value = cells_.at(axis);
  if (value == nullptr) value = layout_entry(offsetof(dpde_layout, global), axis);
  return value;
}

llvm::Value* PlaceEmitter::cells_as_real(int axis) {
  llvm::Value*& value = cells_as_real_.at(axis);
  if (value == nullptr) value = before_.CreateSIToFP(cells(axis), real_);
  return value;
}

llvm::Value* PlaceEmitter::stride(int axis) {
  llvm::Value*& value = stride_.at(axis);
  if (value == nullptr) value = layout_entry(offsetof(dpde_layout, stride), axis);
  return value;
}

/// Cell number along an axis plus `offset`; along x, of the current cell.
llvm::Value* PlaceEmitter::cell(int axis, int offset) {
  llvm::Value* start = axis == 0 ? values_.first : axis == 1 ? values_.y : values_.z;
  llvm::Value* shifted = before_.CreateNSWAdd(start, before_.getInt64(offset));
  return axis == 0 ? body_.CreateNSWAdd(shifted, index_) : shifted;
}

/// Converts from 32 bits: axes have fewer than 2^31 cells, and only AVX-512 converts vectors of 64-bit integers.
llvm::Value* PlaceEmitter::cell_as_real(int axis, int offset) {
  llvm::IRBuilder<>& builder = axis == 0 ? body_ : before_;
  llvm::Value* narrow = builder.CreateTrunc(cell(axis, offset), builder.getInt32Ty());
  return builder.CreateSIToFP(narrow, real_);
}

llvm::Value* PlaceEmitter::inside(const loop::Inside& inside) {
  llvm::Value* all = nullptr;
  for (int axis = row_.rank - 1; axis >= 0; --axis) {
    if (row_.axes.at(axis) == Topology::periodic) continue;
    // -grow <= c < n + grow as one unsigned comparison: c + grow < n + 2 grow.
    llvm::IRBuilder<>& builder = axis == 0 ? body_ : before_;
    llvm::Value* limit = before_.CreateNSWAdd(cells(axis), before_.getInt64(2 * inside.grow));
    llvm::Value* within = builder.CreateICmpULT(cell(axis, inside.offset.at(axis) + inside.grow), limit);
    all = all == nullptr ? within : builder.CreateAnd(all, within);
  }
  return all == nullptr ? body_.getTrue() : all;
}

}  // namespace dpde::codegen
