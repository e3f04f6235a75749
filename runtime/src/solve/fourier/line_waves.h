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

#include "grid/aligned_values.h"
#include "transform/fft.h"

namespace dpde {

/// What both sides of an axis do; the low one first.
enum class Sides { periodic, even_even, odd_odd, even_odd, odd_even };

template <class Real>
class LineWavesOf {
 public:
  /// Numbers side by side: a line of the cache.
  static constexpr std::int64_t width = 64 / sizeof(Real);

  /// `are_complex`: the lines, which are half as many. Such ones on periodic axes are transformed where they are, in
  /// arrays with `step` numbers from cell to cell, and `block` numbers side by side at once.
  LineWavesOf(std::int64_t cells, Sides sides, bool are_complex, std::int64_t step, std::int64_t block);

  std::int64_t cells() const { return cells_; }
  std::int64_t modes() const { return modes_; }
  /// Numbers of one mode over those of one cell: 2 where real lines get complex waves.
  std::int64_t growth() const { return real_ ? 2 : 1; }
  /// The wave turns by 2*pi*turns(mode)/period() from cell to cell.
  std::int64_t turns(std::int64_t mode) const;
  std::int64_t period() const;
  /// What there and back multiplies by.
  double scale() const { return static_cast<double>(sides_ == Sides::periodic ? cells_ : 2 * cells_); }

  /// Numbers side by side of cells.
  std::int64_t block() const { return block_; }
  bool are_in_place() const { return !values_; }
  void place(Real* begin) { begin_ = begin; }
  /// Of lines that are not in place. `step` from cell to cell, `apart` from number to number side by side; what is
  /// beyond `count` of these is 0.
  void read(const Real* from, std::int64_t step, std::int64_t apart, std::int64_t count);
  void write(Real* to, std::int64_t step, std::int64_t apart, std::int64_t count) const;
  void forward();
  void backward();
  void read_waves(const Real* from, std::int64_t step, std::int64_t apart, std::int64_t count);
  void write_waves(Real* to, std::int64_t step, std::int64_t apart, std::int64_t count) const;
  /// By factors of all waves side by side, mode after mode; with `have_phases` complex ones.
  void multiply(const Real* factors, bool have_phases);

 private:
  struct Source {
    std::int64_t cell;
    Real sign;
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
  bool have_complex_waves_;
  Real* begin_ = nullptr;  // rows to be transformed: `values_`, or in the array of who called
  std::int64_t step_ = width, block_ = width;
  std::vector<Source> sources_;                     // of the rows that are transformed
  std::vector<std::complex<Real>> before_, after_;  // factors of rows, before and behind the transform
  AlignedValuesOf<Real> values_, other_;            // rows of `width`; what else is needed
  std::optional<ComplexFftOf<Real>> complex_;
  std::optional<RealFftOf<Real>> real_;
};
using LineWaves = LineWavesOf<double>;

}  // namespace dpde
