// SPDX-License-Identifier: Apache-2.0
// Operators that couple cells along one periodic axis only, with rows that are the same along it and differ from line
// to line, as filters around the poles of a sphere: Fourier series of each line, divided by a symbol of its own.
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
  /// Nothing where the operator is none of these, makes 0 of a wave, or the axis lies between two others.
  static std::optional<LineSeries> of(const StencilMatrix& matrix, const Team& team = 1);

  /// Nothing is allocated; both are aligned as `new` aligns them.
  void divide(std::span<const double> b, std::span<double> x);

 private:
  LineSeries(const RealLines& lines, std::vector<std::complex<double>> factors, const Team& team);

  FftBlocks blocks_;
  std::vector<std::complex<double>> factors_;
  /// One a thread: a block of lines goes there, is divided and goes back while it is in the cache.
  std::vector<std::vector<std::complex<double>>> waves_;
};

}  // namespace dpde
