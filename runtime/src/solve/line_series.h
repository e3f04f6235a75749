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
#include "fft.h"
#include "solve/stencil_matrix.h"

namespace dpde {

class LineSeries {
 public:
  /// Nothing where the operator is none of these, makes 0 of a wave, or the axis lies between two others.
  static std::optional<LineSeries> of(const StencilMatrix& matrix, const Team& team = 1);

  /// Nothing is allocated; both are aligned as `new` aligns them.
  void divide(std::span<const double> b, std::span<double> x);

 private:
  /// Of one thread: a block of lines goes there, is divided and goes back while it is in the cache.
  struct Lines {
    RealFft block;
    std::optional<RealFft> fewer;  // of the lines behind whole blocks
    std::vector<std::complex<double>> waves;
  };

  LineSeries(const RealLines& lines, std::vector<std::complex<double>> factors, const Team& team);

  Team team_;
  RealLines shape_;
  std::int64_t block_;  // lines
  std::vector<std::complex<double>> factors_;
  std::vector<Lines> of_threads_;
};

}  // namespace dpde
