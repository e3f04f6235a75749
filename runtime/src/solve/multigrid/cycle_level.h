// SPDX-License-Identifier: Apache-2.0
// One level of multigrid as its cycles need it: vectors and coefficients in half rows, sweeps over one colour or over
// all cells (solve/smoother.h). A cell is red where the sum of its places along the axes is even, and black elsewhere.
// Vectors have the red cells of all rows before the black ones: what a sweep reads and writes lies one behind the
// other. Threads have slabs of rows; no cell depends on the order of its colour, and sums are made row by row, so that
// results do not depend on the threads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dpde/runtime/team.h"
#include "solve/fourier/grid_waves.h"
#include "solve/matrix/half_rows.h"
#include "solve/multigrid/multigrid_level.h"
#include "solve/multigrid/smoother.h"
#include "solve/operator/finite.h"
#include "solve/operator/numbers.h"
#include "solve/rows/coefficient_rows.h"
#include "solve/rows/row_kernels.h"

namespace dpde {

/// Of floats or doubles (`Real`).
template <class Real>
class CycleLevel {
 public:
  CycleLevel(const MultigridLevel& level, SmootherKind smoother, const Team& team);
  /// Its coefficients times `scale`, in the memory of those before; the grid is that it was made for, as is the
  /// smoother. Where `is_given_up`, `level` loses what it has, array by array. Of its diagonal the inverse is left
  /// else.
  void set(MultigridLevel& level, double scale, bool is_symmetric, SmootherKind smoother, bool is_given_up);
  const std::array<std::int64_t, 3>& cells() const { return cells_; }
  bool has_rings(const std::array<bool, 3>& periodic) const {
    return std::equal(periodic.begin(), periodic.end(), level_.is_ring);
  }

  /// Of a vector of this level.
  std::size_t size() const { return static_cast<std::size_t>(2 * level_.black); }
  std::size_t cell_count() const { return static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]); }
  /// Of right sides and images the rooms are 0, so that dot products with them are those of the cells.
  void pack_right(std::span<const double> cells, double factor, Real* vector) const;
  void pack(std::span<const double> cells, double factor, Real* vector) const;
  /// The same of right sides, whose rows come one by one; sums of cells.
  Sums pack_rows(const ReadRowsOf<double>& cells, double factor, Real* vector);
  /// cells = factor*vector, or cells += that.
  void unpack(const Real* vector, double factor, bool is_added, std::span<double> cells) const;

  /// Smooths for the guess 0 or the one in x; then what b - A*x is on the coarse level.
  void descend(const Real* b, Real* x, bool is_guess_zero, CycleLevel& coarse);
  /// x += what is interpolated of the coarse level; then smooths, backwards or as before. `squares`: null, or becomes
  /// |b - A*x|^2.
  void ascend(const Real* b, Real* x, bool is_backwards, CycleLevel& coarse, double* squares = nullptr);
  /// One behind the other, in half as many passes over memory: where another cycle follows. |b - A*x|^2 between them.
  double ascend_and_descend(const Real* b, Real* x, CycleLevel& coarse);
  /// |b - A*x|^2
  double squared_residual(const Real* b, const Real* x);
  void multiply(const Real* x, Real* y) const;
  /// Of all cells; the rooms stay as they are.
  void subtract(Real value, Real* vector) const;
  /// Where the cells that `cells` numbers are in a vector.
  std::vector<std::uint32_t> places_of(std::span<const std::uint32_t> cells) const;

  NumbersOf<Real> b, x;  // of levels below the finest

 private:
  using Row = RowPlace;
  static constexpr int red = 0, black = 1;
  static constexpr std::int64_t room = numbers_of_line<Real>;  // before rows and behind them

  /// Half a row of a vector.
  std::int64_t place(const Row& row, int half) const {
    return place_of<Real>(level_.stride, level_.black, row.number, row.y, row.z, half);
  }
  template <class Number>
  Number* half(Number* vector, const Row& row, int which) const {
    return vector + place(row, which);
  }
  void close_ring(Real* x, const Row& row) const { rows_.close_ring(half(x, row, 0), half(x, row, 1)); }
  void close_ring(Real* x, const Row& row, int which) const {
    rows_.close_ring(half(x, row, 0), half(x, row, 1), which);
  }
  /// What a thread needs for the rows it works at.
  struct Scratch {
    Numbers cells;  // a row of them
    NumbersOf<Real> halves, line_values;
    NumbersOf<Real> lines;  // what the finer level is interpolated of, and which rows of it these are for
    std::array<std::int64_t, 5> lines_known{};
    Real* line() { return line_values.data() + room; }  // one row in order, with room before and behind
  };
  Scratch& scratch(int thread) { return scratch_[static_cast<std::size_t>(thread)]; }
  void forget_lines() {
    for (Scratch& own : scratch_) own.lines_known.fill(-1);
  }
  /// Of a row, the one that the cells of a colour are.
  int half_of(const Row& row, int colour) const { return static_cast<int>((row.y + row.z + colour) % 2); }
  std::int64_t count_of_rows() const { return cells_[1] * cells_[2]; }
  LevelRows<Real> level_rows(const std::array<bool, 3>& periodic) const;
  /// f(row) one after the other; f(row, thread) by all threads.
  template <class F>
  void for_each_row(const F& f) const;
  template <class F>
  void share_rows(const F& f) const;
  /// f(row, thread), summed.
  template <class F>
  double sum_of_rows(const F& f);
  static double sum_of(const Numbers& of_rows);
  /// Backwards matters where two of a colour are neighbours around an odd ring.
  void smooth(int colour, bool is_backwards, const Real* b, Real* x) const;
  /// All rows, one stage f(row, thread) behind the other by as much as their neighbours are away: a row is still in a
  /// near cache when the next stage takes it. Not where two neighbours are of one colour.
  template <class... Stages>
  void in_turns(const Stages&... stages) const;
  Row row_at(std::int64_t number) const { return {number, number % cells_[1], number / cells_[1]}; }
  void go_on(Row& row) const {
    ++row.number;
    if (++row.y == cells_[1]) row.y = 0, ++row.z;
  }
  void scale_row(const Row& row, const Real* b, Real* x) const;
  double squares_of(const Row& row, int half, const Real* b, const Real* x) const {
    return kernels_.squared_residual[axes_](level_, row, half, b, x);
  }
  void smooth_row(const Row& row, int colour, const Real* b, Real* x) const;
  void relax_row(const Row& row, Real factor, const Real* b, const Real* x, Real* to) const;
  /// The same for x = 0.
  void begin_row(const Row& row, Real factor, const Real* b, Real* to) const;
  void find_residual(const Row& row, const Real* b, const Real* x);
  void restrict_to(CycleLevel& coarse);
  void restrict_row(const Row& row_of_coarse, int thread, CycleLevel& coarse);
  void add_correction(const Row& row, int thread, int colour, CycleLevel& coarse, Real* x) const;
  /// The rows of the fine level that a coarse one takes of.
  void gather(const Row& coarse, int which, RowSum<Real>& sum) const;
  const Real* coarse_line(std::uint32_t y, std::int64_t z, CycleLevel& coarse, Scratch& of_coarse) const;
  std::int64_t line_stride() const { return rows_.stride() + 2 * room; }  // room before and behind

  std::array<std::int64_t, 3> cells_;
  HalfRows rows_;
  std::size_t axes_ = 0;  // number of the last one with several cells
  std::array<CoefficientRows<Real>, 3> coupling_;
  CoefficientRows<Real> own_, inverse_, share_;
  LevelRows<Real> level_{};
  bool is_share_restricted_ = false;  // the transpose of interpolation
  std::array<AxisInterpolation, 3> from_;
  bool is_in_colours_ = true, is_outer_ring_ = false;
  /// Cells are smoothed by colours, and no neighbours are of one: b - A*x is 0 in cells smoothed last, and smoothing
  /// forgets what cells were. Not so around odd rings.
  bool is_chequered_ = true;
  std::array<Real, 2> factors_{};              // of steps of relaxation, where it is not in colours
  std::array<NumbersOf<Real>, 2> near_, far_;  // weights along x, of each half
  std::array<NumbersOf<Real>, 4> restricting_;
  NumbersOf<Real> residual_;  // before it is known, x between two steps of relaxation
  Team team_;
  std::vector<Scratch> scratch_;  // one a thread
  struct {
    Numbers squares, cells;
  } counted_;  // sums of each row
  const RowKernelsOf<Real>& kernels_;
};

extern template class CycleLevel<double>;
extern template class CycleLevel<float>;

}  // namespace dpde
