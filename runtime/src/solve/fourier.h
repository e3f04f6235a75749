// SPDX-License-Identifier: Apache-2.0
// Operators with the same row in all cells, by Fourier series: each wave is divided by the operator's symbol. Beyond
// bounded axes a field goes on as its even or odd image (walls with zero slope or value half a cell outside), so that
// its waves are cosines or sines.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "solve/grid_waves.h"
#include "solve/stencil_matrix.h"

namespace dpde {

class FourierSolver {
 public:
  /// Nothing where the rows are not alike, or differ beside walls from what images make of them.
  /// `is_singular`: of a constant it makes 0.
  static std::optional<FourierSolver> of(const StencilMatrix& matrix, double rounding, bool is_singular);

  /// Waves of the null space are taken out of `b` and are 0 in `x`; |what is taken|/|b|, without the mean. Nothing is
  /// allocated; both are aligned as `new` aligns them.
  double solve(std::span<double> b, std::span<double> x);
  bool has_walls() const;

 private:
  FourierSolver(const StencilMatrix& matrix, const std::vector<double>& row, const std::array<Sides, 3>& sides,
                bool is_singular);
  double drop_waves(std::span<double> b);

  std::array<Sides, 3> sides_;
  GridWaves waves_;
  bool have_phases_;
  std::vector<double> inverse_symbol_;  // factors of waves
  std::vector<double> dropped_;         // likewise, of what is in the null space besides the mean; empty: nothing
  std::vector<double> taken_;           // from b
};

}  // namespace dpde
