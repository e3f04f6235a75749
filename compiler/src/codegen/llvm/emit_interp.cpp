// SPDX-License-Identifier: Apache-2.0
// Interpolation at displaced positions, and its transpose. Along each axis up to four cells around the position have
// weights. The value is the sum over the tensor product of these cells: field value times the weights of all axes.
#include <llvm/IR/Intrinsics.h>

#include "codegen/llvm/emit_place.h"

namespace dpde::codegen {

/// Clamps `cell` (any real) to [low, high] and converts it to an integer; NaN becomes low.
llvm::Value* PlaceEmitter::between(llvm::Value* cell, llvm::Value* low, llvm::Value* high) {
  llvm::Value* at_least = body_.CreateSelect(body_.CreateFCmpOGT(cell, low), cell, low);
  llvm::Value* at_most = body_.CreateSelect(body_.CreateFCmpOLT(at_least, high), at_least, high);
  return body_.CreateSExt(body_.CreateFPToSI(at_most, body_.getInt32Ty()), body_.getInt64Ty());
}

/// Wraps the cell below the position and its neighbours. The number of periods is computed with the reciprocal of the
/// cell count, which is faster than a division for each cell, and from the cell's middle, where rounding cannot change
/// it.
void PlaceEmitter::set_periodic_cells(int axis, llvm::Value* low_cell, Spot& spot) {
  llvm::Value* count = cells_as_real(axis);
  llvm::Value* inverse = before_.CreateFDiv(real(1), count);
  llvm::Value* half = before_.CreateFMul(real(0.5), inverse);
  llvm::Value* middle = body_.CreateFAdd(body_.CreateFMul(low_cell, inverse), half);
  llvm::Value* turns = body_.CreateUnaryIntrinsic(llvm::Intrinsic::floor, middle);
  llvm::Value* last = before_.CreateFSub(count, real(1));
  llvm::Value* low = between(body_.CreateFSub(low_cell, body_.CreateFMul(turns, count)), real(0), last);
  llvm::Value* zero = body_.getInt64(0);
  llvm::Value* one = body_.getInt64(1);
  const auto after = [&](llvm::Value* cell) {
    llvm::Value* next = body_.CreateNSWAdd(cell, one);
    return body_.CreateSelect(body_.CreateICmpEQ(next, cells(axis)), zero, next);
  };
  llvm::Value* from = body_.CreateSelect(body_.CreateICmpEQ(low, zero), cells(axis), low);
  llvm::Value* next = after(low);
  spot.cells = {body_.CreateNSWSub(from, one), low, next, after(next)};
}

/// Clamps the position to [-1/2, n-1/2]: half-way between the outermost cell and the first ghost cell. Differences of
/// cell numbers are exact, so the comparison is too; it is false if the fraction is NaN.
void PlaceEmitter::set_bounded_cells(int axis, llvm::Value* low_cell, Spot& spot) {
  llvm::Value* count = cells_as_real(axis);
  llvm::Value* least = body_.CreateFSub(real(-0.5), low_cell);
  llvm::Value* most = body_.CreateFSub(before_.CreateFSub(count, real(0.5)), low_cell);
  llvm::Value* below = body_.CreateFCmpOLT(spot.fraction, least);
  llvm::Value* above = body_.CreateFCmpOGT(spot.fraction, most);
  llvm::Value* clamped = body_.CreateOr(below, above);
  spot.fraction = body_.CreateSelect(clamped, real(0.5), spot.fraction);
  spot.rate = body_.CreateSelect(clamped, real(0), real(1));
  llvm::Value* low = between(low_cell, real(-1), before_.CreateFSub(count, real(1)));
  for (int k = 0; k < 4; ++k) spot.cells.at(k) = body_.CreateNSWAdd(low, body_.getInt64(k - 1));
}

PlaceEmitter::Spot PlaceEmitter::spot(int axis, int offset, llvm::Value* displacement) {
  llvm::Value* whole = body_.CreateUnaryIntrinsic(llvm::Intrinsic::floor, displacement);
  llvm::Value* low_cell = body_.CreateFAdd(cell_as_real(axis, offset), whole);
  Spot result{{}, body_.CreateFSub(displacement, whole), real(1)};
  if (row_.axes.at(axis) == Topology::periodic) {
    set_periodic_cells(axis, low_cell, result);
  } else {
    set_bounded_cells(axis, low_cell, result);
  }
  return result;
}

llvm::Value* PlaceEmitter::polynomial(const std::array<double, 4>& coefficients, llvm::Value* x) {
  llvm::Value* result = nullptr;
  for (int power = 3; power >= 0; --power) {
    const double c = coefficients.at(power);
    if (result != nullptr) result = body_.CreateFMul(result, x);
    if (c == 0) continue;
    result = result == nullptr ? real(c) : body_.CreateFAdd(result, real(c));
  }
  return result;
}

PlaceEmitter::Taps PlaceEmitter::weigh(const Spot& spot, InterpolationBasis along) {
  // Keeps a NaN displacement visible in weights that do not depend on the displacement.
  llvm::Value* is_nan = body_.CreateFCmpUNO(spot.fraction, spot.fraction);
  llvm::Value* rate = body_.CreateSelect(is_nan, spot.fraction, is_derivative(along) ? spot.rate : real(1));
  const AlongWeights weights = weights_of(along);
  Taps taps;
  for (int k = 0; k < 4; ++k) {
    llvm::Value* weight = polynomial(weights.at(k), spot.fraction);
    if (weight == nullptr) continue;
    const bool sees_fraction = along == InterpolationBasis::linear || along == InterpolationBasis::cubic;
    taps.push_back({spot.cells.at(k), sees_fraction ? weight : body_.CreateFMul(weight, rate)});
  }
  return taps;
}

std::vector<PlaceEmitter::Taps> PlaceEmitter::taps(const loop::Interp& interp,
                                                   const std::vector<llvm::Value*>& displacement) {
  std::vector<Taps> result;
  for (int axis = 0; axis < row_.rank; ++axis) {
    result.push_back(weigh(spot(axis, interp.offset.at(axis), displacement.at(axis)), interp.along.at(axis)));
    for (Tap& tap : result.back()) {
      if (axis > 0) tap.element = body_.CreateNSWMul(tap.element, stride(axis));
    }
  }
  return result;
}

/// `element` advanced by the tap's element offset.
llvm::Value* PlaceEmitter::moved(llvm::Value* element, const Tap& tap) {
  return element == nullptr ? tap.element : body_.CreateNSWAdd(element, tap.element);
}

/// Interpolates along axes 0 to `axis`; `element` is the position along the other axes.
llvm::Value* PlaceEmitter::gather(const std::vector<Taps>& taps, int axis, llvm::Value* element, llvm::Value* base) {
  if (axis < 0) return body_.CreateAlignedLoad(real_, body_.CreateInBoundsGEP(real_, base, element), alignment());
  llvm::Value* sum = nullptr;
  for (const Tap& tap : taps[axis]) {
    llvm::Value* term = body_.CreateFMul(tap.weight, gather(taps, axis - 1, moved(element, tap), base));
    sum = sum == nullptr ? term : body_.CreateFAdd(sum, term);
  }
  return sum;
}

llvm::Value* PlaceEmitter::interp(const loop::Interp& interp, const std::vector<llvm::Value*>& displacement) {
  return gather(taps(interp, displacement), row_.rank - 1, nullptr, values_.grids.at(interp.grid));
}

/// Transpose of gather: appends `share` times the weights along axes 0 to `axis`, with target elements, to `shares`.
void PlaceEmitter::spread(const std::vector<Taps>& taps, int axis, llvm::Value* element, llvm::Value* share,
                          std::vector<Share>& shares) {
  if (axis < 0) return shares.push_back({element, share});
  for (const Tap& tap : taps[axis])
    spread(taps, axis - 1, moved(element, tap), body_.CreateFMul(share, tap.weight), shares);
}

int places_of_scatters(const loop::Row& row) {
  int places = 0;
  for (const loop::Scatter& scatter : row.scatters) {
    int corners = 1;
    for (int axis = 0; axis < row.rank; ++axis) corners *= reach_of(scatter.target.along.at(axis)) > 1 ? 4 : 2;
    places += corners;
  }
  return places;
}

std::vector<PlaceEmitter::Share> PlaceEmitter::scatter(const loop::Interp& target,
                                                       const std::vector<llvm::Value*>& displacement,
                                                       llvm::Value* value) {
  std::vector<Share> shares;
  spread(taps(target, displacement), row_.rank - 1, nullptr, value, shares);
  return shares;
}

}  // namespace dpde::codegen
