// SPDX-License-Identifier: Apache-2.0
// Fourier modes of several adjacent lines along one axis. On a bounded axis lines are continued evenly or oddly about a
// point half a cell outside; the modes are those of the discrete cosine and sine transforms of types II and IV (Strang
// 1999). Two adjacent lines form one complex line, since all these transforms are linear. Type II is the Fourier
// transform of the cells in another order (Makhoul 1980), type IV is two transforms of half the length.
#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "grid/aligned_values.h"
#include "transform/fft.h"

namespace dpde {

/// Symmetry at both sides of an axis, the low one first.
enum class Sides { periodic, even_even, odd_odd, even_odd, odd_even };

template <class Real>
class LineWavesOf {
 public:
  /// Adjacent numbers: one cache line.
  static constexpr std::int64_t width = 64 / sizeof(Real);

  /// `are_complex`: the lines, which are half as many. Complex lines on periodic axes are transformed in place, in
  /// arrays with `step` numbers from cell to cell, `block` adjacent numbers in one go.
  LineWavesOf(std::int64_t cells, Sides sides, bool are_complex, std::int64_t step, std::int64_t block);

  std::int64_t cells() const { return cells_; }
  std::int64_t modes() const { return modes_; }
  /// Numbers of a mode relative to those of a cell: 2 if real lines have complex modes.
  std::int64_t growth() const { return real_ ? 2 : 1; }
  /// The phase shift of the mode from cell to cell is 2*pi*turns(mode)/period().
  std::int64_t turns(std::int64_t mode) const;
  std::int64_t period() const;
  /// Factor by which forward and backward transforms together multiply.
  double scale() const { return static_cast<double>(sides_ == Sides::periodic ? cells_ : 2 * cells_); }

  /// Adjacent numbers of a cell.
  std::int64_t block() const { return block_; }
  bool are_in_place() const { return !values_; }
  void place(Real* begin) { begin_ = begin; }
  /// For lines that are not in place. `step`: from cell to cell, `apart`: between adjacent numbers; those beyond
  /// `count` are set to 0.
  void read(const Real* from, std::int64_t step, std::int64_t apart, std::int64_t count);
  void write(Real* to, std::int64_t step, std::int64_t apart, std::int64_t count) const;
  void forward();
  void backward();
  void read_waves(const Real* from, std::int64_t step, std::int64_t apart, std::int64_t count);
  void write_waves(Real* to, std::int64_t step, std::int64_t apart, std::int64_t count) const;
  /// Multiplies by factors of all adjacent modes, mode by mode; complex ones with `have_phases`.
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
  Real* begin_ = nullptr;  // rows to transform: `values_`, or the caller's array
  std::int64_t step_ = width, block_ = width;
  std::vector<Source> sources_;                     // of the rows to transform
  std::vector<std::complex<Real>> before_, after_;  // factors of rows, before and after the transform
  AlignedValuesOf<Real> values_, other_;            // rows of `width`; work array
  std::optional<ComplexFftOf<Real>> complex_;
  std::optional<RealFftOf<Real>> real_;
};
using LineWaves = LineWavesOf<double>;

}  // namespace dpde
