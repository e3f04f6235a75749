// SPDX-License-Identifier: Apache-2.0
// The equations of one level of multigrid, and how those of the next one are made of them.
//
// A level holds couplings w >= 0 between neighbours and what is left of each row, e >= 0:
// (A*x)_i = e_i*x_i + sum_j w_ij*(x_i - x_j). Levels are made of each other: two cells along an axis become one, whose
// equation is the sum of theirs, and the last one of an odd number stays by itself, around a ring too; a coupling
// between coarse cells is the sum of those that cross, over how much longer the way is (half of it, mostly).
// What is interpolated is linear between coarse cells. The transpose of that, as symmetric cycles take it, carries
// residuals over jumps of the coefficient to where they are large beside all that is there: with conjugate gradients
// 763 cycles to 1e-6 around a disc of 1e6. Where couplings jump it is constant then, and 13 cycles are enough
// (Wesseling 1988 has piecewise constant ones for such coefficients). Axes along which cells are coupled less than a
// quarter as strongly as along the strongest are not made coarser.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "solve/matrix/stencil_matrix.h"

namespace dpde {

/// Interpolation along one axis: of each fine cell the two coarse ones it is made of.
struct AxisInterpolation {
  bool is_halved = false;
  std::vector<std::uint32_t> near, far;
  std::vector<double> near_weight, far_weight;
  // Where halved: coarse cell i takes so much of the residuals of the fine cells 2i-1 to 2i+2, around rings too.
  std::array<std::vector<double>, 4> weights;

  /// Memory stays.
  void clear();
};

struct MultigridLevel {
  std::array<std::int64_t, 3> cells{};
  std::array<bool, 3> periodic{};
  std::array<std::vector<double>, 3> width;        // of cells along each axis; 1 on the finest level
  std::array<std::vector<double>, 3> coupling;     // of each cell with the next one along the axis
  std::vector<double> rest, diagonal;              // e, and with the couplings
  std::array<std::array<bool, 2>, 3> has_value{};  // walls at the low and the high side
  std::array<AxisInterpolation, 3> from;           // the next level; empty on the coarsest
  std::vector<double> share;  // of what is interpolated: more where some of the coarse cells have no equation

  std::size_t size() const { return static_cast<std::size_t>(cells[0] * cells[1] * cells[2]); }
};

/// What the level lacks: its diagonal and walls.
void complete(MultigridLevel& level);
/// Whether a coarser level was made, with the interpolation from it, in the memory of what `coarse` was. Restriction is
/// the transpose, or the plain sum.
bool make_coarser(MultigridLevel& fine, MultigridLevel& coarse, bool is_symmetric);
/// `share` of the fine level, of a coarse one that is complete.
void find_shares(MultigridLevel& fine, const MultigridLevel& coarse);
/// The least share that an axis which became coarser has of what cells are coupled with, on the whole.
double least_share(const MultigridLevel& level);
/// What all cells are coupled with along each axis, but for those at its bounded end; nothing where they differ.
std::optional<std::array<double, 3>> even_couplings(const MultigridLevel& level);
/// Whether cells are coupled along one axis less than half as strongly as along another.
bool is_uneven(const MultigridLevel& level);
/// In the memory of what `matrix` was.
void write_matrix(const MultigridLevel& level, StencilMatrix& matrix);

}  // namespace dpde
