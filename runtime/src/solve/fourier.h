// SPDX-License-Identifier: Apache-2.0
// Operators with the same row in all cells, by Fourier series: each wave is divided by the operator's symbol. Beyond
// bounded axes a field goes on as its even or odd image (walls with zero slope or value half a cell outside), so that
// it is periodic on a grid of twice or four times the length (of the cosine and sine transforms, Strang 1999).
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "solve/stencil_matrix.h"

namespace dpde {

class FourierSolver {
 public:
  /// Nothing where the rows are not alike, or differ beside walls from what images make of them.
  /// `is_singular`: of a constant it makes 0.
  static std::optional<FourierSolver> of(const StencilMatrix& matrix, double rounding, bool is_singular);
  FourierSolver(FourierSolver&&) noexcept;
  FourierSolver& operator=(FourierSolver&&) noexcept;
  ~FourierSolver();

  /// Waves of the null space are taken out of `b` and are 0 in `x`; |what is taken|/|b|, without the mean.
  double solve(std::span<double> b, std::span<double> x);
  bool has_walls() const;

 private:
  using Complex = std::complex<double>;
  /// How the values go on beyond both sides of an axis.
  struct Images {
    bool is_periodic = true;
    double low = 1, high = 1;  // of bounded axes: 1 even, -1 odd
  };
  struct Lines;
  FourierSolver(const StencilMatrix& matrix, const std::vector<double>& row, const std::array<Images, 3>& images,
                bool is_singular);
  static bool is_made_of(const StencilMatrix& matrix, const std::vector<double>& row,
                         const std::array<Images, 3>& images, double rounding);
  void transform(std::vector<Complex>& values, bool is_forward);
  void transform_columns(Complex* values, std::int64_t n, std::int64_t step, std::int64_t columns, bool is_forward);
  double drop_waves(std::span<double> b);
  void take(const std::vector<Complex>& waves, std::span<double> values) const;
  void extend(std::span<const double> b);
  void extend_along(std::size_t axis);

  std::array<std::int64_t, 3> cells_{}, length_{};  // of the grid, of the periodic one
  std::array<Images, 3> images_;
  std::vector<Complex> waves_, kept_;
  std::vector<Complex> inverse_symbol_;
  bool drops_waves_ = false;  // besides the mean
  std::unique_ptr<Lines> lines_;
};

}  // namespace dpde
