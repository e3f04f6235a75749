// SPDX-License-Identifier: Apache-2.0
// Operators that couple cells along one periodic axis only, with rows that are constant along it and differ from line
// to line, such as filters around the poles of a sphere: Fourier series of each line, divided by the line's own symbol.
#pragma once

#include <complex>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dpde/runtime/team.h"
#include "solve/fourier/fft_blocks.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

class LineSeries {
 public:
  /// Empty if the operator has another form or a zero symbol, or if the axis lies between two others.
  static std::optional<LineSeries> of(const StencilMatrix& matrix, const Team& team = 1);

  /// Allocates nothing; both need the alignment of `new`.
  void divide(std::span<const double> b, std::span<double> x);

 private:
  LineSeries(const RealLines& lines, std::vector<std::complex<double>> factors, const Team& team);

  FftBlocks blocks_;
  std::vector<std::complex<double>> factors_;
  /// One for each thread: a block of lines is transformed, divided and transformed back while it is in the cache.
  std::vector<std::vector<std::complex<double>>> waves_;
};

}  // namespace dpde
