// SPDX-License-Identifier: Apache-2.0
// Waves of several lines side by side along one axis. Where the axis is bounded, lines go on as their even or odd
// images half a cell outside, and the waves are those of the discrete cosine and sine transforms of types II and IV
// (Strang 1999). Two lines side by side are one complex line, as all of these transforms are linear: a transform of
// type II is the Fourier transform of the cells in another order (Makhoul 1980), one of type IV is two of half the
// length.
#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "fft.h"

namespace dpde {

/// What both sides of an axis do; the low one first.
enum class Sides { periodic, even_even, odd_odd, even_odd, odd_even };

struct FreeMemory {
  void operator()(double* memory) const;
};
using AlignedValues = std::unique_ptr<double[], FreeMemory>;
/// All zero.
AlignedValues aligned_values(std::int64_t count);

class LineWaves {
 public:
  static constexpr std::int64_t width = 8;  // doubles side by side: a line of the cache

  /// `are_complex`: the lines, which are half as many.
  LineWaves(std::int64_t cells, Sides sides, bool are_complex);

  std::int64_t cells() const { return cells_; }
  std::int64_t modes() const { return modes_; }
  /// Doubles of one mode over those of one cell: 2 where real lines get complex waves.
  std::int64_t growth() const { return real_ ? 2 : 1; }
  /// The wave turns by 2*pi*turns(mode)/period() from cell to cell.
  std::int64_t turns(std::int64_t mode) const;
  std::int64_t period() const;
  /// What there and back multiplies by.
  double scale() const { return static_cast<double>(sides_ == Sides::periodic ? cells_ : 2 * cells_); }

  /// `step` from cell to cell, `apart` from double to double side by side; what is beyond `count` of these is 0.
  void read(const double* from, std::int64_t step, std::int64_t apart, std::int64_t count);
  void write(double* to, std::int64_t step, std::int64_t apart, std::int64_t count) const;
  void forward();
  void backward();
  void read_waves(const double* from, std::int64_t step, std::int64_t apart, std::int64_t count);
  void write_waves(double* to, std::int64_t step, std::int64_t apart, std::int64_t count) const;
  /// `factors`: like waves, `step` from mode to mode. `are_complex`: the factors.
  void multiply(const double* factors, std::int64_t step, bool are_complex);

 private:
  struct Source {
    std::int64_t cell;
    double sign;
  };

  void make_sources();
  void make_turns();
  void split_halves();
  void join_halves();
  void join_all();
  void cosines_of_any_length();
  bool is_mixed() const { return sides_ == Sides::even_odd || sides_ == Sides::odd_even; }

  std::int64_t cells_, modes_;
  Sides sides_;
  std::vector<Source> sources_;                       // of the rows that are transformed
  std::vector<std::complex<double>> before_, after_;  // factors of rows, before and behind the transform
  AlignedValues values_, other_;                      // rows of `width`; what else is needed
  std::optional<ComplexFft> complex_;
  std::optional<RealFft> real_;
};

}  // namespace dpde
