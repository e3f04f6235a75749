// SPDX-License-Identifier: Apache-2.0
// One level of multigrid in the form of its cycles: vectors and coefficients in half rows, sweeps over one colour or
// over all cells (solve/multigrid/smoother.h). A cell is red if the sum of its indices along the axes is even, else
// black. Vectors have the red cells of all rows before the black ones: so a sweep reads and writes contiguous memory.
// Threads have slabs of rows; cells of one colour are independent, and sums are made row by row, so that results do not
// depend on the threads.
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

/// In floats or doubles (`Real`).
template <class Real>
class CycleLevel {
 public:
  CycleLevel(const MultigridLevel& level, SmootherKind smoother, const Team& team);
  /// Sets the coefficients to those of `level` times `scale`, reusing memory; grid and smoother must be those of the
  /// constructor. `is_given_up`: frees the arrays of `level` one by one. Otherwise its diagonal is replaced by its
  /// inverse.
  void set(MultigridLevel& level, double scale, bool is_symmetric, SmootherKind smoother, bool is_given_up);
  const std::array<std::int64_t, 3>& cells() const { return cells_; }
  bool has_rings(const std::array<bool, 3>& periodic) const {
    return std::equal(periodic.begin(), periodic.end(), level_.is_ring);
  }

  /// Size of a vector of this level.
  std::size_t size() const { return static_cast<std::size_t>(2 * level_.black); }
  std::size_t cell_count() const { return static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]); }
  /// Clears the extra spaces of right sides and images, so that dot products are over cells only.
  void pack_right(std::span<const double> cells, double factor, Real* vector) const;
  void pack(std::span<const double> cells, double factor, Real* vector) const;
  /// The same for right sides whose rows are read one by one; returns the sums of the cells.
  Sums pack_rows(const ReadRowsOf<double>& cells, double factor, Real* vector);
  /// cells = factor*vector, or cells += that.
  void unpack(const Real* vector, double factor, bool is_added, std::span<double> cells) const;

  /// Smooths, from 0 or from the guess in x; then restricts the residual b - A*x to the coarse level.
  void descend(const Real* b, Real* x, bool is_guess_zero, CycleLevel& coarse);
  /// Adds the interpolated correction of the coarse level to x; then smooths, in reverse or the same order. `squares`:
  /// if not null, set to |b - A*x|^2.
  void ascend(const Real* b, Real* x, bool is_backwards, CycleLevel& coarse, double* squares = nullptr);
  /// Both in one, in half as many passes over memory, if another cycle follows. Returns |b - A*x|^2 in between.
  double ascend_and_descend(const Real* b, Real* x, CycleLevel& coarse);
  /// |b - A*x|^2
  double squared_residual(const Real* b, const Real* x);
  void multiply(const Real* x, Real* y) const;
  /// Subtracts from all cells; the extra spaces are not changed.
  void subtract(Real value, Real* vector) const;
  /// Indices in a vector of the cells numbered in `cells`.
  std::vector<std::uint32_t> places_of(std::span<const std::uint32_t> cells) const;

  NumbersOf<Real> b, x;  // for levels below the finest

 private:
  using Row = RowPlace;
  static constexpr int red = 0, black = 1;
  static constexpr std::int64_t room = numbers_of_line<Real>;  // before and after rows

  /// Index of half a row in a vector.
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
  /// Work memory of a thread.
  struct Scratch {
    Numbers cells;  // one row
    NumbersOf<Real> halves, line_values;
    NumbersOf<Real> lines;  // coarse values interpolated to lines, and their row numbers
    std::array<std::int64_t, 5> lines_known{};
    Real* line() { return line_values.data() + room; }  // one row in order, with space before and after
  };
  Scratch& scratch(int thread) { return scratch_[static_cast<std::size_t>(thread)]; }
  void forget_lines() {
    for (Scratch& own : scratch_) own.lines_known.fill(-1);
  }
  /// The half of a row that has the cells of a colour.
  int half_of(const Row& row, int colour) const { return static_cast<int>((row.y + row.z + colour) % 2); }
  std::int64_t count_of_rows() const { return cells_[1] * cells_[2]; }
  LevelRows<Real> level_rows(const std::array<bool, 3>& periodic) const;
  /// Calls f(row) in order.
  template <class F>
  void for_each_row(const F& f) const;
  template <class F>
  void share_rows(const F& f) const;
  /// Sum of f(row, thread).
  template <class F>
  double sum_of_rows(const F& f);
  static double sum_of(const Numbers& of_rows);
  /// The order matters if two cells of one colour are neighbours across an odd periodic axis.
  void smooth(int colour, bool is_backwards, const Real* b, Real* x) const;
  /// Runs the stages f(row, thread) over all rows, each stage behind the previous one by the distance of neighbours: a
  /// row is still in a near cache for the next stage. Not if two neighbours have one colour.
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
  /// Collects the rows of the fine level that a coarse row restricts.
  void gather(const Row& coarse, int which, RowSum<Real>& sum) const;
  const Real* coarse_line(std::uint32_t y, std::int64_t z, CycleLevel& coarse, Scratch& of_coarse) const;
  std::int64_t line_stride() const { return rows_.stride() + 2 * room; }  // with space before and after

  std::array<std::int64_t, 3> cells_;
  HalfRows rows_;
  std::size_t axes_ = 0;  // index of the last one with several cells
  std::array<CoefficientRows<Real>, 3> coupling_;
  CoefficientRows<Real> own_, inverse_, share_;
  LevelRows<Real> level_{};
  bool is_share_restricted_ = false;  // restriction is the transpose of interpolation
  std::array<AxisInterpolation, 3> from_;
  bool is_in_colours_ = true, is_outer_ring_ = false;
  /// Smoothing goes by colours, and no neighbours have the same one (false for odd periodic axes): b - A*x is 0 in the
  /// cells smoothed last, and smoothing does not use the old values of a cell.
  bool is_chequered_ = true;
  std::array<Real, 2> factors_{};              // of relaxation steps, if smoothing is not by colours
  std::array<NumbersOf<Real>, 2> near_, far_;  // interpolation weights along x, for each half
  std::array<NumbersOf<Real>, 4> restricting_;
  NumbersOf<Real> residual_;  // also stores x between two relaxation steps
  Team team_;
  std::vector<Scratch> scratch_;  // one a thread
  struct {
    Numbers squares, cells;
  } counted_;  // of each row
  const RowKernelsOf<Real>& kernels_;
};

extern template class CycleLevel<double>;
extern template class CycleLevel<float>;

}  // namespace dpde
