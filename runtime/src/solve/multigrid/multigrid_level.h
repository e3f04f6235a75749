// SPDX-License-Identifier: Apache-2.0
// The equations of one level of multigrid, and the construction of those of the next one.
//
// A level has couplings w >= 0 between neighbours and a rest e >= 0 of each row: (A*x)_i = e_i*x_i + sum_j w_ij*(x_i -
// x_j). Along a coarsened axis two cells become one, whose equation is the sum of theirs; the last cell of an odd
// number is not merged, on a periodic axis neither. A coupling between coarse cells is the sum of the couplings that
// cross the face, divided by the ratio of the distances (mostly 2). Interpolation is linear between coarse cells. Its
// transpose, the restriction of symmetric cycles, carries residuals across jumps of the coefficient to cells where they
// are large compared with the rest: conjugate gradients then need 763 cycles to 1e-6 around a disc of 1e6. If couplings
// jump interpolation is therefore piecewise constant, and 13 cycles suffice (as in Wesseling 1988 for such
// coefficients). Axes with couplings below a quarter of the strongest axis are not coarsened.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "solve/matrix/stencil_matrix.h"

namespace dpde {

/// Interpolation along one axis: for each fine cell two coarse cells and their weights.
struct AxisInterpolation {
  bool is_halved = false;
  std::vector<std::uint32_t> near, far;
  std::vector<double> near_weight, far_weight;
  // If halved: weights of the residuals of the fine cells 2i-1 to 2i+2 in coarse cell i, also across a periodic end.
  std::array<std::vector<double>, 4> weights;

  /// Keeps the memory.
  void clear();
};

struct MultigridLevel {
  std::array<std::int64_t, 3> cells{};
  std::array<bool, 3> periodic{};
  std::array<std::vector<double>, 3> width;        // of cells along each axis; 1 on the finest level
  std::array<std::vector<double>, 3> coupling;     // of each cell with the next one along the axis
  std::vector<double> rest, diagonal;              // e; e plus the couplings
  std::array<std::array<bool, 2>, 3> has_value{};  // walls with a value, at the low and the high side
  std::array<AxisInterpolation, 3> from;           // from the next level; empty on the coarsest
  std::vector<double> share;  // factor of the interpolated value: above 1 if some of the coarse cells have no equation

  std::size_t size() const { return static_cast<std::size_t>(cells[0] * cells[1] * cells[2]); }
};

/// Computes the diagonal and finds the walls.
void complete(MultigridLevel& level);
/// Makes a coarser level, if possible, and the interpolation from it, reusing the memory of `coarse`. Restriction is
/// the transpose, or the plain sum.
bool make_coarser(MultigridLevel& fine, MultigridLevel& coarse, bool is_symmetric);
/// Computes `share` of the fine level; the coarse one must be complete.
void find_shares(MultigridLevel& fine, const MultigridLevel& coarse);
/// The smallest share of a coarsened axis in the total couplings of a cell, on average.
double least_share(const MultigridLevel& level);
/// The coupling along each axis, if it is the same in all cells except at bounded ends; else empty.
std::optional<std::array<double, 3>> even_couplings(const MultigridLevel& level);
/// Whether cells are coupled along one axis less than half as strongly as along another.
bool is_uneven(const MultigridLevel& level);
/// Writes to the memory of `matrix`.
void write_matrix(const MultigridLevel& level, StencilMatrix& matrix);

}  // namespace dpde
