// SPDX-License-Identifier: Apache-2.0
// Multilinear interpolation at computed places and its transpose. Along every axis the point lies between two cells;
// the value is the sum over their 2^rank combinations of value times the weights along the axes.
#include <llvm/IR/Intrinsics.h>

#include "codegen/llvm/emit_place.h"

namespace dpde::codegen {

/// `cell`, a real that may be anything, as a number in [low, high]; NaN becomes low.
llvm::Value* PlaceEmitter::between(llvm::Value* cell, llvm::Value* low, llvm::Value* high) {
  llvm::Value* at_least = body_.CreateSelect(body_.CreateFCmpOGT(cell, low), cell, low);
  llvm::Value* at_most = body_.CreateSelect(body_.CreateFCmpOLT(at_least, high), at_least, high);
  return body_.CreateSExt(body_.CreateFPToSI(at_most, body_.getInt32Ty()), body_.getInt64Ty());
}

PlaceEmitter::Pair PlaceEmitter::weigh(const Spot& spot, bool slope) {
  Pair result;
  if (!slope) {
    result.weight = {body_.CreateFSub(real(1), spot.fraction), spot.fraction};
    return result;
  }
  // The weights -1 and 1 do not depend on the displacement, but one that is no place shall not go unseen.
  llvm::Value* rate = spot.clamped == nullptr ? real(1) : body_.CreateSelect(spot.clamped, real(0), real(1));
  llvm::Value* is_nan = body_.CreateFCmpUNO(spot.fraction, spot.fraction);
  llvm::Value* one = body_.CreateSelect(is_nan, spot.fraction, rate);
  result.weight = {body_.CreateFNeg(one), one};
  return result;
}

PlaceEmitter::Pair PlaceEmitter::pair(int axis, int offset, llvm::Value* displacement, bool slope) {
  llvm::Value* whole = body_.CreateUnaryIntrinsic(llvm::Intrinsic::floor, displacement);
  llvm::Value* start = cell_as_real(axis, offset);
  llvm::Value* count = cells_as_real(axis);
  llvm::Value* last = before_.CreateFSub(count, real(1));
  Spot spot{body_.CreateFAdd(start, whole), body_.CreateFSub(displacement, whole), nullptr};
  llvm::Value* one = body_.getInt64(1);
  llvm::Value* low = nullptr;
  llvm::Value* high = nullptr;
  if (row_.axes.at(axis) == Topology::periodic) {
    llvm::Value* turns = body_.CreateUnaryIntrinsic(llvm::Intrinsic::floor, body_.CreateFDiv(spot.low_cell, count));
    low = between(body_.CreateFSub(spot.low_cell, body_.CreateFMul(turns, count)), real(0), last);
    llvm::Value* next = body_.CreateNSWAdd(low, one);
    high = body_.CreateSelect(body_.CreateICmpEQ(next, cells(axis)), body_.getInt64(0), next);
  } else {
    // The position is clamped to [-1/2, n-1/2]: half-way between the outermost cell and its neighbour in the halo.
    // The differences of cells are exact, so the decision is too; it is "no" where the fraction is NaN.
    llvm::Value* least = body_.CreateFSub(real(-0.5), spot.low_cell);
    llvm::Value* most = body_.CreateFSub(before_.CreateFSub(count, real(0.5)), spot.low_cell);
    llvm::Value* below = body_.CreateFCmpOLT(spot.fraction, least);
    llvm::Value* above = body_.CreateFCmpOGT(spot.fraction, most);
    spot.clamped = body_.CreateOr(below, above);
    spot.fraction = body_.CreateSelect(spot.clamped, real(0.5), spot.fraction);
    low = between(spot.low_cell, real(-1), last);
    high = body_.CreateNSWAdd(low, one);
  }
  Pair result = weigh(spot, slope);
  result.element = {low, high};
  if (axis > 0) {
    for (llvm::Value*& element : result.element) element = body_.CreateNSWMul(element, stride(axis));
  }
  return result;
}

std::vector<PlaceEmitter::Pair> PlaceEmitter::pairs(const loop::Interp& interp,
                                                    const std::vector<llvm::Value*>& displacement) {
  std::vector<Pair> result;
  for (int axis = 0; axis < row_.rank; ++axis) {
    result.push_back(pair(axis, interp.offset.at(axis), displacement.at(axis), interp.slope.at(axis)));
  }
  return result;
}

/// Bit a of `corner` says which of the two cells along axis a.
llvm::Value* PlaceEmitter::element_pointer(const std::vector<Pair>& pairs, int corner, llvm::Value* base) {
  llvm::Value* element = nullptr;
  for (int axis = row_.rank - 1; axis >= 0; --axis) {
    llvm::Value* along = pairs[axis].element.at(corner >> axis & 1);
    element = element == nullptr ? along : body_.CreateNSWAdd(element, along);
  }
  return body_.CreateInBoundsGEP(real_, base, element);
}

/// Interpolates along axes 0 to `axis`; the bits of `corner` say where along the others.
llvm::Value* PlaceEmitter::gather(const std::vector<Pair>& pairs, int axis, int corner, llvm::Value* base) {
  if (axis < 0) {
    return body_.CreateAlignedLoad(real_, element_pointer(pairs, corner, base), alignment());
  }
  llvm::Value* low = gather(pairs, axis - 1, corner, base);
  llvm::Value* high = gather(pairs, axis - 1, corner | 1 << axis, base);
  const Pair& along = pairs[axis];
  llvm::Value* of_low = body_.CreateFMul(along.weight[0], low);
  return body_.CreateFAdd(of_low, body_.CreateFMul(along.weight[1], high));
}

llvm::Value* PlaceEmitter::interp(const loop::Interp& interp, const std::vector<llvm::Value*>& displacement) {
  return gather(pairs(interp, displacement), row_.rank - 1, 0, values_.grids.at(interp.grid));
}

void PlaceEmitter::scatter(const loop::Interp& target, const std::vector<llvm::Value*>& displacement,
                           llvm::Value* value) {
  const std::vector<Pair> along = pairs(target, displacement);
  for (int corner = 0; corner < 1 << row_.rank; ++corner) {
    llvm::Value* share = value;
    for (int axis = 0; axis < row_.rank; ++axis) {
      share = body_.CreateFMul(share, along[axis].weight.at(corner >> axis & 1));
    }
    llvm::Value* address = element_pointer(along, corner, values_.grids.at(target.grid));
    llvm::Value* old = body_.CreateAlignedLoad(real_, address, alignment());
    body_.CreateAlignedStore(body_.CreateFAdd(old, share), address, alignment());
  }
}

}  // namespace dpde::codegen
