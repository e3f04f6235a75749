// SPDX-License-Identifier: Apache-2.0
// Operators with the same row in all cells, by Fourier series: each mode is divided by the operator's symbol. Along
// bounded axes modes are cosines or sines.
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
  /// Empty if the rows are not constant. `is_singular`: constants are in the null space.
  static std::optional<FourierSolver> of(const StencilMatrix& matrix, double rounding, bool is_singular,
                                         const Team& team = 1);
  FourierSolver(const ConstantRows& rows, bool is_singular, const Team& team = 1);

  /// Removes modes of the null space from `b`; they are 0 in `x`. Returns |removed part|/|b|, without the mean.
  /// Allocates nothing; both need the alignment of `new`.
  double solve(std::span<double> b, std::span<double> x);
  bool drops_waves() const { return !dropped_.empty(); }
  /// The same without changing b, for an operator that drops no modes.
  void divide(std::span<const double> b, std::span<double> x);
  /// The same from field to field (GridWaves::multiply_rows).
  std::optional<PassedRows> divide_rows(const ReadRowsOf<double>& b, const WriteRowsOf<double>& x) {
    return waves_.multiply_rows(b, inverse_symbol_.data(), have_phases_, x);
  }
  /// In floats, if has_floats().
  std::optional<PassedRows> divide_rows(const ReadRowsOf<float>& b, const WriteRowsOf<float>& x) {
    return floats_->multiply_rows(b, inverse_of_floats_.data(), have_phases_, x);
  }
  /// Tests whether floats are accurate enough for the operator, which has the same rows; allocates their memory once.
  void try_floats(const GridOperator& a);
  bool has_floats() const { return floats_.has_value(); }
  bool has_walls() const;

 private:
  using Complex = std::complex<double>;
  /// e^(2*pi*i*j/period) of each axis; real parts only for a bounded one.
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
  std::vector<double> inverse_symbol_;  // multipliers of modes
  std::vector<double> dropped_;         // 1 for modes of the null space besides the mean; empty: none
  std::vector<double> taken_;           // removed from b
  std::optional<GridWavesOf<float>> floats_;
  std::vector<float> inverse_of_floats_;
};

}  // namespace dpde
