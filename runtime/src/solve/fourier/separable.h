// SPDX-License-Identifier: Apache-2.0
// Operators whose rows are the same along periodic axes and which couple neighbours along the one other axis, as
// Poisson's equation in a channel with a stretched axis, on a disc and on a sphere: each wave along the periodic axes
// is a tridiagonal system along the other one (R. W. Hockney, J. ACM 12, 1965, 95).
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dpde/runtime/team.h"
#include "solve/fourier/fft_blocks.h"
#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"
#include "transform/fft.h"

namespace dpde {

class SeparableSolver {
 public:
  /// Nothing where the operator is none of these, tells a wave from its mirror image, or has a wave whose diagonal does
  /// not dominate: elimination takes no pivots.
  static std::optional<SeparableSolver> of(const StencilMatrix& matrix, const NullSpace& null_space,
                                           const Team& team = 1);

  /// Where constants make 0 the mean of `b` is left out and that of `x` is 0. Nothing is allocated; both are aligned as
  /// `new` aligns them.
  void divide(std::span<const double> b, std::span<double> x);

  /// Which axis is transformed first, by real series, which one then, and along which lines are eliminated.
  struct Axes {
    std::size_t first = 0, along = 0;
    std::optional<std::size_t> second;
  };

 private:
  using Complex = std::complex<double>;
  /// Waves lie one behind the other in rows; how far it is from one number of an axis to the next is said in rows.
  struct Shape {
    std::int64_t modes = 1, second = 1, length = 1;  // along the first axis, the second one, the lines
    std::int64_t second_step = 0, length_step = 0;
  };
  /// Of a wave: x[i] = y[i]*pivot - upper*x[i + 1] with y[i] = b[i] - lower*y[i - 1].
  struct Factors {
    std::vector<double> lower, pivot, upper;
  };

  SeparableSolver(const Axes& axes, const std::array<std::int64_t, 3>& cells, bool is_singular, const Team& team);
  bool factor(const StencilMatrix& matrix, const Axes& axes);
  std::int64_t row_of(std::int64_t second, std::int64_t i) const {
    return (second * shape_.second_step + i * shape_.length_step) * shape_.modes;
  }
  void transform_second(bool back);
  void eliminate(std::int64_t second, std::int64_t begin, std::int64_t end);
  void take_mean_away();

  FftBlocks firsts_;
  Shape shape_;
  bool is_singular_;
  Factors factors_;
  std::vector<Complex> waves_;
  std::vector<ComplexFft> seconds_;  // one a thread; none: there is no second axis
};

}  // namespace dpde
