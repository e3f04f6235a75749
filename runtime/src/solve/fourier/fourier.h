// SPDX-License-Identifier: Apache-2.0
// Operators with the same row in all cells, by Fourier series: each wave is divided by the operator's symbol. Along
// bounded axes waves are cosines or sines.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "solve/fourier/grid_waves.h"
#include "solve/matrix/stencil_matrix.h"
#include "solve/operator/grid_operator.h"
#include "solve/rows/constant_rows.h"

namespace dpde {

class FourierSolver {
 public:
  /// Nothing where the rows are not constant. `is_singular`: of a constant it makes 0.
  static std::optional<FourierSolver> of(const StencilMatrix& matrix, double rounding, bool is_singular,
                                         const Team& team = 1);
  FourierSolver(const ConstantRows& rows, bool is_singular, const Team& team = 1);

  /// Waves of the null space are taken out of `b` and are 0 in `x`; |what is taken|/|b|, without the mean. Nothing is
  /// allocated; both are aligned as `new` aligns them.
  double solve(std::span<double> b, std::span<double> x);
  bool drops_waves() const { return !dropped_.empty(); }
  /// Where it drops no waves: the same, and b stays.
  void divide(std::span<const double> b, std::span<double> x);
  /// The same from field to field (GridWaves::multiply_rows).
  std::optional<PassedRows> divide_rows(const ReadRowsOf<double>& b, const WriteRowsOf<double>& x) {
    return waves_.multiply_rows(b, inverse_symbol_.data(), have_phases_, x);
  }
  /// In floats, where these will do.
  std::optional<PassedRows> divide_rows(const ReadRowsOf<float>& b, const WriteRowsOf<float>& x) {
    return floats_->multiply_rows(b, inverse_of_floats_.data(), have_phases_, x);
  }
  /// Whether floats will do for the operator, which has the same rows: memory is taken for it once.
  void try_floats(const GridOperator& a);
  bool has_floats() const { return floats_.has_value(); }
  bool has_walls() const;

 private:
  using Complex = std::complex<double>;
  /// e^(2*pi*i*j/period) of each axis, or their real parts where it is bounded.
  using Turns = std::array<std::vector<Complex>, 3>;
  Turns all_turns() const;
  Complex symbol_of(const std::array<std::int64_t, 3>& turns, const Turns& factors) const;
  template <class Real>
  void find_inverse(const GridWavesOf<Real>& waves, std::vector<Real>& inverse_symbol);
  void drop(std::size_t number);
  double drop_waves(std::span<double> b);

  ConstantRows rows_;
  Team team_;
  GridWaves waves_;
  bool is_singular_, have_phases_;
  std::vector<double> inverse_symbol_;  // factors of waves
  std::vector<double> dropped_;         // likewise, of what is in the null space besides the mean; empty: nothing
  std::vector<double> taken_;           // from b
  std::optional<GridWavesOf<float>> floats_;
  std::vector<float> inverse_of_floats_;
};

}  // namespace dpde
