// SPDX-License-Identifier: Apache-2.0
// Operators whose rows are constant along periodic axes and which couple neighbours along the one other axis, such as
// Poisson's equation in a channel with a stretched axis, on a disc and on a sphere. Each Fourier mode along the
// periodic axes is a tridiagonal system along the other one (R. W. Hockney, J. ACM 12, 1965, 95).
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
  /// Empty if the operator has another form, if a mode and its mirror image have different multipliers, or if a mode's
  /// system is not diagonally dominant: elimination does not pivot.
  static std::optional<SeparableSolver> of(const StencilMatrix& matrix, const NullSpace& null_space,
                                           const Team& team = 1);

  /// If constants are in the null space the mean of `b` is ignored and that of `x` is 0. Allocates nothing; both need
  /// the alignment of `new`.
  void divide(std::span<const double> b, std::span<double> x);

  /// The axis transformed first, by real series, the second one, if any, and the axis of elimination.
  struct Axes {
    std::size_t first = 0, along = 0;
    std::optional<std::size_t> second;
  };

 private:
  using Complex = std::complex<double>;
  /// The modes are contiguous in rows; steps between indices of an axis are in rows.
  struct Shape {
    std::int64_t modes = 1, second = 1, length = 1;  // along the first axis, the second one, the lines
    std::int64_t second_step = 0, length_step = 0;
  };
  /// For one mode: x[i] = y[i]*pivot - upper*x[i + 1] with y[i] = b[i] - lower*y[i - 1].
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
  std::vector<ComplexFft> seconds_;  // one for each thread; none without a second axis
};

}  // namespace dpde
