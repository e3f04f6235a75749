// SPDX-License-Identifier: Apache-2.0
// Multiplies the Fourier modes of a field on a grid: forward and backward transforms, axis after axis. Along the last
// axis blocks of columns stay in the cache in between. Blocks, and so results, do not depend on the number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "dpde/runtime/team.h"
#include "solve/fourier/line_waves.h"
#include "solve/operator/finite.h"

namespace dpde {

/// Contiguous values of cells from cell `first` on: whole rows along x. Called by several threads in parallel.
template <class Real>
using ReadRowsOf = std::function<void(std::int64_t first, std::span<Real> values)>;
template <class Real>
using WriteRowsOf = std::function<void(std::int64_t first, std::span<const Real> values)>;

/// Sums of the values read, and whether the values written are finite.
struct PassedRows {
  Sums read;
  bool is_finite;
};

template <class Real>
class GridWavesOf {
 public:
  GridWavesOf(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides, const Team& team = 1);

  /// Number of factors, including unused ones. On periodic axes a mode and its complex conjugate share one.
  std::int64_t size() const { return are_complex_ ? size_ / 2 : size_; }
  bool are_complex() const { return are_complex_; }
  /// Factor by which forward and backward transforms together multiply.
  double scale() const { return scale_; }
  /// Calls `f`(index of the factor, phase shift of the mode from cell to cell along each axis, in units of
  /// 2*pi/period).
  void for_each(const std::function<void(std::size_t number, const std::array<std::int64_t, 3>& turns)>& f) const;
  std::int64_t period(std::size_t axis) const;

  /// Allocates nothing. `have_phases`: the factors are complex. Arrays need the alignment of `new`.
  void multiply(std::span<const Real> field, const Real* factors, bool have_phases, std::span<Real> product);
  /// The same between fields of any layout, whose rows are read and written during the transforms. Returns nothing, and
  /// writes nothing, if squares of the input may overflow.
  std::optional<PassedRows> multiply_rows(const ReadRowsOf<Real>& read, const Real* factors, bool have_phases,
                                          const WriteRowsOf<Real>& write);

 private:
  /// Lines along the first axis.
  struct FirstShape {
    std::size_t axis = 0;
    std::int64_t count = 1, planes = 1;  // lines in each plane, number of planes
    std::int64_t row = 0, plane = 0;     // numbers in a row and in a plane of its modes, with gaps
    std::int64_t block = 1;              // lines transformed in one go
  };
  /// Transforms of a block of lines along the first axis, and of the last, smaller block. For one thread.
  struct FirstLines {
    std::optional<RealFftOf<Real>> ring, fewer;  // for a periodic axis
    std::optional<LineWavesOf<Real>> images;     // for a bounded axis
    AlignedValuesOf<Real> values;                // of a block
  };
  /// An axis after the first, of arrays with rows of `inner` adjacent numbers.
  struct Stage {
    std::size_t axis;
    std::vector<LineWavesOf<Real>> of_threads;
    std::int64_t outer, inner;
    Real *from = nullptr, *to = nullptr;
    std::int64_t from_plane = 0, to_plane = 0;  // numbers from one index of `outer` to the next
    const LineWavesOf<Real>& lines() const { return of_threads.front(); }
  };

  std::size_t number_of(std::int64_t row, std::int64_t along) const;
  void make_first(std::size_t axis, std::int64_t cells, Sides sides);
  void make_stage(std::size_t axis, std::int64_t cells, Sides sides, bool is_last);
  bool has_images() const { return firsts_.front().images.has_value(); }
  template <class F>
  void for_each_block_of_first(const F& f);
  void first_forward(FirstLines& own, const Real* from, Real* to, std::int64_t lines) const;
  void first_backward(FirstLines& own, Real* from, Real* to, std::int64_t lines) const;
  void multiply_behind_first(const Real* factors, bool have_phases);
  Extent extent() const;
  static void read(const Stage& stage, LineWavesOf<Real>& lines, Real* from);
  static void write(const Stage& stage, const LineWavesOf<Real>& lines, Real* to);
  template <class F>
  void for_each_block(Stage& stage, const F& f) const;
  void forward(Stage& stage) const;
  void backward(Stage& stage) const;
  void multiply_last(Stage& stage, const Real* factors, bool have_phases) const;
  void multiply_line(const Real* field, const Real* factors, bool have_phases, Real* product);

  Team team_;
  std::array<std::int64_t, 3> cells_, modes_{1, 1, 1};
  FirstShape lines_;
  std::vector<FirstLines> firsts_;  // one a thread
  std::vector<Extent> extents_;     // of blocks
  std::vector<Stage> stages_;
  std::int64_t row_ = 0, size_ = 0;  // numbers in a row of all modes; of all modes
  bool are_complex_ = false;
  double scale_ = 1;
  AlignedValuesOf<Real> first_,
      second_;  // modes along the first axis; later ones, after an axis where real modes become complex
};
using GridWaves = GridWavesOf<double>;

}  // namespace dpde
