// SPDX-License-Identifier: Apache-2.0
// Geometric multigrid for operators that couple each cell with its neighbours along the axes, symmetrically and with
// one sign: diffusion with coefficients, obstacles and walls, with or without a term of its own (Brandt 1977; of cells
// in place of nodes, Wesseling 1988).
//
// A level holds couplings w >= 0 between neighbours and what is left of each row, e >= 0:
// (A*x)_i = e_i*x_i + sum_j w_ij*(x_i - x_j). Levels are made of each other: two cells along an axis become one, whose
// equation is the sum of theirs; a coupling between coarse cells is half the sum of those that cross (twice the way).
// Axes along which cells are coupled less than a quarter as strongly as along the strongest are not made coarser. One
// V-cycle smooths red cells, then black ones, on the way down and up; in reverse on the way up where the cycle has to
// be symmetric, to precondition CG (measured: 6 to 8 cycles in place of 12 to 1e-6). Interpolation is linear and
// restriction its transpose.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "solve/null_space.h"
#include "solve/stencil_matrix.h"

namespace dpde {

class Multigrid {
 public:
  /// Nothing where the operator has another form.
  static std::optional<Multigrid> of(const StencilMatrix& matrix, const NullSpace& null_space, double rounding,
                                     bool is_symmetric);
  /// Of the symmetric part of the neighbours' entries; for preconditioners of operators that have others too.
  static std::optional<Multigrid> of_symmetric_part(const StencilMatrix& matrix, double rounding);

  /// One cycle, for the guess 0: x is about A^-1*b.
  void cycle(std::span<const double> b, std::span<double> x);
  int levels() const { return static_cast<int>(levels_.size()); }

 private:
  struct Level {
    std::array<std::int64_t, 3> cells{};
    std::array<bool, 3> periodic{};
    std::array<std::vector<double>, 3> coupling;     // of each cell with the next one along the axis
    std::vector<double> rest, inverse;               // e, 1/diagonal (0 of cells without entries)
    std::array<bool, 3> is_halved{};                 // of the next level
    std::array<std::array<bool, 2>, 3> has_value{};  // walls at the low and the high side
    std::vector<double> b, x, residual;

    std::size_t size() const { return rest.size(); }
  };
  static std::optional<Multigrid> make(Level finest, double sign);
  static bool has_coarser(const Level& fine, Level& coarse);
  static void set_inverse(Level& level);
  static void find_walls(Level& level);
  static void smooth(Level& level, int colour);
  static void find_residual(Level& level);
  static void restrict_residual(const Level& fine, Level& coarse);
  static void add_correction(Level& fine, const Level& coarse);
  void descend(std::size_t level);

  std::vector<Level> levels_;
  Eigen::MatrixXd coarsest_inverse_;
  double sign_ = 1;
  bool is_symmetric_ = false;
};

}  // namespace dpde
