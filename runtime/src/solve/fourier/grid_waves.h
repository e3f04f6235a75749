// SPDX-License-Identifier: Apache-2.0
// Multiplies the waves of a field on a grid: axis after axis there and back, the last one in blocks of columns that
// stay in the cache between there and back. Blocks are the same by any number of threads, and so are results.
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

/// Values of cells that follow one another, from the cell `first` on: whole rows along x. By several threads at once.
template <class Real>
using ReadRowsOf = std::function<void(std::int64_t first, std::span<Real> values)>;
template <class Real>
using WriteRowsOf = std::function<void(std::int64_t first, std::span<const Real> values)>;

/// What multiply_rows has read, and whether what it has written is finite.
struct PassedRows {
  Sums read;
  bool is_finite;
};

template <class Real>
class GridWavesOf {
 public:
  GridWavesOf(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides, const Team& team = 1);

  /// How many factors there are, of which some are of no wave. Two waves of periodic axes are one, the other being its
  /// conjugate.
  std::int64_t size() const { return are_complex_ ? size_ / 2 : size_; }
  bool are_complex() const { return are_complex_; }
  /// What there and back multiplies by.
  double scale() const { return scale_; }
  /// `f`(number of its factor, by which angle a wave turns from cell to cell along each axis, in turns of
  /// 2*pi/period).
  void for_each(const std::function<void(std::size_t number, const std::array<std::int64_t, 3>& turns)>& f) const;
  std::int64_t period(std::size_t axis) const;

  /// Nothing is allocated. `have_phases`: the factors are complex. Arrays are aligned as `new` aligns them.
  void multiply(std::span<const Real> field, const Real* factors, bool have_phases, std::span<Real> product);
  /// The same between fields of any form, rows of which are read and written as they are transformed. Nothing where
  /// squares of what is read may be no numbers, before anything is written.
  std::optional<PassedRows> multiply_rows(const ReadRowsOf<Real>& read, const Real* factors, bool have_phases,
                                          const WriteRowsOf<Real>& write);

 private:
  /// Lines along the first axis.
  struct FirstShape {
    std::size_t axis = 0;
    std::int64_t count = 1, planes = 1;  // in each of so many planes
    std::int64_t row = 0, plane = 0;     // numbers of a row and of a plane of its waves, with gaps
    std::int64_t block = 1;              // lines that are transformed at once
  };
  /// Transforms of a block of lines along the first axis, and of fewer lines, the last ones. Of one thread.
  struct FirstLines {
    std::optional<RealFftOf<Real>> ring, fewer;  // it is periodic
    std::optional<LineWavesOf<Real>> images;     // or bounded
    AlignedValuesOf<Real> values;                // of a block
  };
  /// An axis behind the first, of arrays with rows of `inner` numbers side by side.
  struct Stage {
    std::size_t axis;
    std::vector<LineWavesOf<Real>> of_threads;
    std::int64_t outer, inner;
    Real *from = nullptr, *to = nullptr;
    std::int64_t from_plane = 0, to_plane = 0;  // numbers from one of `outer` to the next
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
  std::int64_t row_ = 0, size_ = 0;  // numbers of a row of all waves; of all waves
  bool are_complex_ = false;
  double scale_ = 1;
  AlignedValuesOf<Real> first_,
      second_;  // waves along the first axis; those behind an axis where real ones become complex
};
using GridWaves = GridWavesOf<double>;

}  // namespace dpde
