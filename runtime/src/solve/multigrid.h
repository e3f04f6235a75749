// SPDX-License-Identifier: Apache-2.0
// Geometric multigrid for operators that couple each cell with its neighbours along the axes, symmetrically and with
// one sign: diffusion with coefficients, obstacles and walls, with or without a term of its own (Brandt 1977; of cells
// in place of nodes, Wesseling 1988).
//
// A level holds couplings w >= 0 between neighbours and what is left of each row, e >= 0:
// (A*x)_i = e_i*x_i + sum_j w_ij*(x_i - x_j). Levels are made of each other: two cells along an axis become one, whose
// equation is the sum of theirs, and the last one of an odd number stays by itself, around a ring too; a coupling
// between coarse cells is the sum of those that cross, over how much longer the way is (half of it, mostly).
// Axes along which cells are coupled less than a quarter as strongly as along the strongest are not made coarser. One
// V-cycle smooths red cells, then black ones, on the way down and up; in reverse on the way up where the cycle has to
// be symmetric, to precondition CG (measured: 6 to 8 cycles in place of 12 to 1e-6). Interpolation is linear and
// restriction its transpose. The coarsest level has sparse factors.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solve/null_space.h"
#include "solve/stencil_matrix.h"
#include "solve/symmetric_factors.h"

namespace dpde {

/// Interpolation along one axis: of each fine cell the two coarse ones it is made of.
struct AxisInterpolation {
  bool is_halved = false;
  std::vector<std::uint32_t> near, far;
  std::vector<double> near_weight, far_weight;
  // The transpose. Coarse cell i takes of the fine cells 2i-1 to 2i+2, but for the first and the last one.
  std::array<std::vector<double>, 4> weights;
  struct End {
    std::uint32_t coarse, fine;
    double weight;
  };
  std::vector<End> ends;
};

struct MultigridLevel {
  std::array<std::int64_t, 3> cells{};
  std::array<bool, 3> periodic{};
  std::array<std::vector<double>, 3> width;        // of cells along each axis; 1 on the finest level
  std::array<std::vector<double>, 3> coupling;     // of each cell with the next one along the axis
  std::vector<double> rest, diagonal, inverse;     // e; 1/diagonal is 0 of cells without entries
  std::array<std::array<bool, 2>, 3> has_value{};  // walls at the low and the high side
  std::array<AxisInterpolation, 3> from;           // the next level
  std::vector<double> b, x, residual, line;

  std::size_t size() const { return rest.size(); }
};

class Multigrid {
 public:
  /// Nothing where the operator has another form: `why` is what it has.
  static std::optional<Multigrid> of(const StencilMatrix& matrix, const NullSpace& null_space, double rounding,
                                     bool is_symmetric, std::string& why);
  /// Of the symmetric part of the neighbours' entries; for preconditioners of operators that have others too.
  static std::optional<Multigrid> of_symmetric_part(const StencilMatrix& matrix, const NullSpace& null_space,
                                                    double rounding, std::string& why);

  /// One cycle, for the guess 0: x is about A^-1*b.
  void cycle(std::span<const double> b, std::span<double> x);
  int levels() const { return static_cast<int>(levels_.size()); }

 private:
  using Level = MultigridLevel;
  static std::optional<Multigrid> make(Level finest, double sign, std::string& why);
  void descend(std::size_t level);

  std::vector<Level> levels_;
  std::optional<SymmetricFactors> coarsest_;
  double sign_ = 1;
  bool is_symmetric_ = false;
};

/// What the level lacks: 1/diagonal, walls, memory.
void complete(MultigridLevel& level);
/// Whether a coarser level was made, with the interpolation from it.
bool make_coarser(MultigridLevel& fine, MultigridLevel& coarse);
StencilMatrix matrix_of(const MultigridLevel& level);

}  // namespace dpde
