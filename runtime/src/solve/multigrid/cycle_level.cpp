// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid/cycle_level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "solve/multigrid/cycle_turns.h"
#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

/// Allocates memory if the size differs.
template <class Real>
void copy_into(std::span<const double> values, NumbersOf<Real>& to) {
  if (to.size() != values.size()) to = NumbersOf<Real>(values.size());
  std::ranges::transform(values, to.data(), [](double value) { return static_cast<Real>(value); });
}

/// The same for even or odd indices.
template <class Real>
void copy_every_second(std::span<const double> values, std::size_t half, NumbersOf<Real>& to) {
  const std::size_t size = (values.size() + 1 - half) / 2;
  if (to.size() != size) to = NumbersOf<Real>(size);
  for (std::size_t i = 0; i < size; ++i) to[i] = static_cast<Real>(values[2 * i + half]);
}

/// Sums of differences beyond the ends along x, where x is 0, contain an extra w*x there.
void take_ends_away(MultigridLevel& level, double w) {
  const auto length = static_cast<std::size_t>(level.cells[0]);
  for (std::size_t first = 0; first < level.size(); first += length) {
    level.rest[first] -= w;
    level.rest[first + length - 1] -= w;
  }
}

}  // namespace

template <class Real>
double CycleLevel<Real>::sum_of(const Numbers& of_rows) {
  double sum = 0;
  for (std::size_t row = 0; row < of_rows.size(); ++row) sum += of_rows.data()[row];
  return sum;
}

template <class Real>
template <class F>
double CycleLevel<Real>::sum_of_rows(const F& f) {
  share_rows([&](const Row& row, int) { counted_.squares[static_cast<std::size_t>(row.number)] = f(row); });
  return sum_of(counted_.squares);
}

template <class Real>
CycleLevel<Real>::CycleLevel(const MultigridLevel& level, SmootherKind smoother, const Team& team)
    : cells_(level.cells),
      rows_(level.cells[0], level.periodic[0], room),
      is_in_colours_(smoother == SmootherKind::red_black),
      is_chequered_(is_in_colours_),
      kernels_(row_kernels().of<Real>()) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells_[axis] > 1) axes_ = axis;
    if (level.periodic[axis] && cells_[axis] % 2 == 1) is_chequered_ = false;
  }
  is_outer_ring_ = level.periodic[axes_];
  level_ = level_rows(level.periodic);
  residual_ = NumbersOf<Real>(size());
  if (static_cast<std::int64_t>(cell_count()) >= least_cells_of_team) team_ = team;
  for (int thread = 0; thread < team.threads(); ++thread) {  // also for threads that work on a finer level
    Scratch& own = scratch_.emplace_back();
    own.cells = Numbers(static_cast<std::size_t>(rows_.cells()));
    own.halves = NumbersOf<Real>(static_cast<std::size_t>(rows_.stride()));
    own.line_values = NumbersOf<Real>(static_cast<std::size_t>(rows_.cells() + 2 * room));
    own.lines = NumbersOf<Real>(own.lines_known.size() * static_cast<std::size_t>(line_stride()));
  }
  counted_.squares = Numbers(static_cast<std::size_t>(count_of_rows()));
  counted_.cells = Numbers(static_cast<std::size_t>(count_of_rows()));
}

template <class Real>
void CycleLevel<Real>::set(MultigridLevel& level, double scale, bool is_symmetric, SmootherKind smoother,
                           bool is_given_up) {
  const auto take = [&](CoefficientRows<Real>& rows, std::vector<double>& values, double factor) {
    rows.set(rows_, values, factor);
    if (is_given_up) values = {};
  };
  const auto even = even_couplings(level);
  std::ranges::transform(factors_of(smoother, least_share(level)), factors_.begin(),
                         [](double factor) { return static_cast<Real>(factor); });
  is_share_restricted_ = is_symmetric && std::ranges::any_of(level.share, [](double share) { return share != 1; });
  from_ = level.from;
  level_.is_even = even.has_value();
  for (std::size_t axis = 0; axis < 3; ++axis) level_.even[axis] = static_cast<Real>(even ? scale * (*even)[axis] : 0);
  take(share_, level.share, 1);
  for (std::size_t axis = 0; axis < 3; ++axis) take(coupling_[axis], level.coupling[axis], scale);
  if constexpr (has_differences<Real>) {
    if (even && !level_.is_ring[0]) take_ends_away(level, static_cast<double>(level_.even[0]) / scale);
    take(own_, level.rest, scale);
  } else {
    own_.set(rows_, level.diagonal, scale);
  }
  for (double& entry : level.diagonal) entry = entry > 0 ? 1 / entry : 0;
  take(inverse_, level.diagonal, 1 / scale);
  for (std::size_t axis = 0; axis < 3; ++axis) level_.coupling[axis] = coupling_[axis].rows();
  level_.own = own_.rows();
  level_.inverse = inverse_.rows();
  for (std::size_t half : {0u, 1u}) {
    copy_every_second(from_[0].near_weight, half, near_[half]);
    copy_every_second(from_[0].far_weight, half, far_[half]);
  }
  for (std::size_t k = 0; k < 4; ++k) copy_into(from_[0].weights[k], restricting_[k]);
}

template <class Real>
void CycleLevel<Real>::pack_right(std::span<const double> cells, double factor, Real* vector) const {
  share_rows([&](const Row& row, int) {
    const double* const from = cells.data() + row.number * rows_.cells();
    kernels_.split(rows_.cells(), from, factor, half(vector, row, 0), half(vector, row, 1));
    rows_.open_ring(half(vector, row, 0), half(vector, row, 1));
  });
}

template <class Real>
void CycleLevel<Real>::pack(std::span<const double> cells, double factor, Real* vector) const {
  pack_right(cells, factor, vector);
  for_each_row([&](const Row& row) { close_ring(vector, row); });
}

template <class Real>
Sums CycleLevel<Real>::pack_rows(const ReadRowsOf<double>& cells, double factor, Real* vector) {
  share_rows([&](const Row& row, int thread) {
    const std::span<double> values = scratch(thread).cells;
    cells(row.number * rows_.cells(), values);
    double sum = 0, squares = 0;
#pragma omp simd reduction(+ : sum, squares)
    for (std::size_t i = 0; i < values.size(); ++i) sum += values[i], squares += values[i] * values[i];
    counted_.cells[static_cast<std::size_t>(row.number)] = sum;
    counted_.squares[static_cast<std::size_t>(row.number)] = squares;
    kernels_.split(rows_.cells(), values.data(), factor, half(vector, row, 0), half(vector, row, 1));
  });
  return {.sum = sum_of(counted_.cells), .squares = sum_of(counted_.squares)};
}

template <class Real>
void CycleLevel<Real>::unpack(const Real* vector, double factor, bool is_added, std::span<double> cells) const {
  share_rows([&](const Row& row, int) {
    double* const to = cells.data() + row.number * rows_.cells();
    kernels_.join(rows_.cells(), half(vector, row, 0), half(vector, row, 1), factor, is_added, to);
  });
}

/// Without coefficients, whose memory does not move with the level.
template <class Real>
LevelRows<Real> CycleLevel<Real>::level_rows(const std::array<bool, 3>& periodic) const {
  LevelRows<Real> rows{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    rows.cells[axis] = cells_[axis];
    rows.is_ring[axis] = periodic[axis];
  }
  rows.odd = rows_.begin(1);
  rows.stride = rows_.begin(1);              // there are as many even cells, or one more
  constexpr std::int64_t apart = 17 * room;  // a load waits if both colours of a row have the same address modulo 4 KiB
  rows.black = rows.stride * count_of_rows() + apart;
  return rows;
}

template <class Real>
void CycleLevel<Real>::smooth_row(const Row& row, int colour, const Real* b, Real* x) const {
  kernels_.smooth[axes_](level_, row, half_of(row, colour), b, x);
  close_ring(x, row, half_of(row, colour));
}

/// For red cells, if all others are 0.
template <class Real>
void CycleLevel<Real>::scale_row(const Row& row, const Real* b, Real* x) const {
  kernels_.scale(level_, row, half_of(row, red), 1, b, x);
  close_ring(x, row, half_of(row, red));
}

template <class Real>
void CycleLevel<Real>::relax_row(const Row& row, Real factor, const Real* b, const Real* x, Real* to) const {
  for (const int half : {0, 1}) kernels_.relax[axes_](level_, row, half, factor, b, x, to);
  close_ring(to, row);
}

template <class Real>
void CycleLevel<Real>::begin_row(const Row& row, Real factor, const Real* b, Real* to) const {
  for (const int half : {0, 1}) kernels_.scale(level_, row, half, factor, b, to);
  close_ring(to, row);
}

template <class Real>
void CycleLevel<Real>::find_residual(const Row& row, const Real* b, const Real* x) {
  for (const int which : {0, 1}) {
    if (is_chequered_ && which != half_of(row, red)) continue;
    kernels_.residual[axes_](level_, row, which, b, x, residual_.data());
    if (is_share_restricted_)
      kernels_.take_share(rows_.count(which), share_.row(row.number) + rows_.begin(which),
                          half(residual_.data(), row, which));
  }
}

template <class Real>
void CycleLevel<Real>::smooth(int colour, bool is_backwards, const Real* b, Real* x) const {
  if (!is_backwards || is_chequered_) return for_each_row([&](const Row& row) { smooth_row(row, colour, b, x); });
  for (std::int64_t z = cells_[2] - 1, number = count_of_rows() - 1; z >= 0; --z) {
    for (std::int64_t y = cells_[1] - 1; y >= 0; --y) smooth_row({number--, y, z}, colour, b, x);
  }
}

template <class Real>
void CycleLevel<Real>::descend(const Real* b, Real* x, bool is_guess_zero, CycleLevel& coarse) {
  const auto residual = [&](const Row& row, int) { find_residual(row, b, x); };
  Real* between = residual_.data();
  const auto [first, second] = factors_;
  if (!is_in_colours_) {
    const auto begin = [&](const Row& row, int) {
      is_guess_zero ? begin_row(row, first, b, between) : relax_row(row, first, b, x, between);
    };
    in_turns(
        begin, [&](const Row& row, int) { relax_row(row, second, b, between, x); }, residual);
  } else if (is_chequered_) {
    in_turns([&](const Row& row, int) { is_guess_zero ? scale_row(row, b, x) : smooth_row(row, red, b, x); },
             [&](const Row& row, int) { smooth_row(row, black, b, x); }, residual);
  } else {
    if (is_guess_zero) std::fill_n(x, size(), 0.0);
    smooth(red, false, b, x);
    smooth(black, false, b, x);
    share_rows(residual);
  }
  restrict_to(coarse);
}

template <class Real>
void CycleLevel<Real>::ascend(const Real* b, Real* x, bool is_backwards, CycleLevel& coarse, double* squares) {
  const int first = is_backwards ? black : red, second = 1 - first;
  Real* between = residual_.data();
  coarse.forget_lines();
  const auto add = [&](const Row& row, int thread) { add_correction(row, thread, second, coarse, x); };
  const auto count_all = [&](const Row& row, int) {
    counted_.squares[static_cast<std::size_t>(row.number)] = squares_of(row, 0, b, x) + squares_of(row, 1, b, x);
  };
  const auto in_turns_or_counted = [&](const auto& one, const auto& other, const auto& count) {
    squares == nullptr ? in_turns(add, one, other) : in_turns(add, one, other, count);
  };
  if (!is_in_colours_) {
    in_turns_or_counted([&](const Row& row, int) { relax_row(row, factors_[1], b, x, between); },
                        [&](const Row& row, int) { relax_row(row, factors_[0], b, between, x); }, count_all);
  } else if (is_chequered_) {
    in_turns_or_counted([&](const Row& row, int) { smooth_row(row, first, b, x); },
                        [&](const Row& row, int) { smooth_row(row, second, b, x); },
                        [&](const Row& row, int) {
                          counted_.squares[static_cast<std::size_t>(row.number)] =
                              squares_of(row, half_of(row, first), b, x);
                        });
  } else {
    share_rows(add);
    smooth(first, is_backwards, b, x);
    smooth(second, is_backwards, b, x);
    if (squares != nullptr) share_rows(count_all);
  }
  if (squares != nullptr) *squares = sum_of(counted_.squares);
}

template <class Real>
double CycleLevel<Real>::ascend_and_descend(const Real* b, Real* x, CycleLevel& coarse) {
  if (!is_chequered_) {
    double squares = 0;
    ascend(b, x, false, coarse, &squares);
    descend(b, x, false, coarse);
    return squares;
  }
  coarse.forget_lines();
  const auto smooth_red = [&](const Row& row, int) { smooth_row(row, red, b, x); };
  const auto smooth_black = [&](const Row& row, int) { smooth_row(row, black, b, x); };
  const auto smooth_counted = [&](const Row& row, int) {
    counted_.squares[static_cast<std::size_t>(row.number)] =
        kernels_.smooth_counted[axes_](level_, row, half_of(row, red), b, x);
    close_ring(x, row, half_of(row, red));
  };
  in_turns([&](const Row& row, int thread) { add_correction(row, thread, black, coarse, x); }, smooth_red, smooth_black,
           smooth_counted, smooth_black, [&](const Row& row, int) { find_residual(row, b, x); });
  restrict_to(coarse);
  return sum_of(counted_.squares);
}

template <class Real>
double CycleLevel<Real>::squared_residual(const Real* b, const Real* x) {
  return sum_of_rows([&](const Row& row) { return squares_of(row, 0, b, x) + squares_of(row, 1, b, x); });
}

template <class Real>
void CycleLevel<Real>::multiply(const Real* x, Real* y) const {
  share_rows([&](const Row& row, int) {
    for (const int which : {0, 1}) kernels_.multiply[axes_](level_, row, which, x, y);
    rows_.open_ring(half(y, row, 0), half(y, row, 1));
  });
}

template <class Real>
void CycleLevel<Real>::subtract(Real value, Real* vector) const {
  share_rows([&](const Row& row, int) {
    for (const int which : {0, 1}) {
      Real* const values = half(vector, row, which);
      for (std::int64_t i = 0; i < rows_.count(which); ++i) values[i] -= value;
    }
  });
}

template <class Real>
std::vector<std::uint32_t> CycleLevel<Real>::places_of(std::span<const std::uint32_t> cells) const {
  std::vector<std::uint32_t> places;
  for (const std::int64_t cell : cells) {
    const std::int64_t number = cell / cells_[0], x = cell % cells_[0];
    const Row row{number, number % cells_[1], number / cells_[1]};
    places.push_back(static_cast<std::uint32_t>(place(row, static_cast<int>(x % 2)) + x / 2));
  }
  return places;
}

template <class Real>
void CycleLevel<Real>::gather(const Row& coarse, int which, RowSum<Real>& sum) const {
  const auto for_each = [&](std::size_t axis, std::int64_t at, const auto& f) {
    const AxisInterpolation& from = from_[axis];
    if (!from.is_halved) return f(at, 1.0);
    for (std::int64_t k = 0; k < 4; ++k) {
      const double weight = from.weights[static_cast<std::size_t>(k)][static_cast<std::size_t>(at)];
      if (weight == 0) continue;
      const std::int64_t fine = 2 * at - 1 + k;
      f(fine < 0 ? fine + cells_[axis] : fine < cells_[axis] ? fine : fine - cells_[axis], weight);
    }
  };
  sum.terms = 0;
  for_each(2, coarse.z, [&](std::int64_t z, double in_z) {
    for_each(1, coarse.y, [&](std::int64_t y, double in_y) {
      if (is_chequered_ && (y + z) % 2 != which) return;
      sum.values[sum.terms] = half(residual_.data(), Row{y + cells_[1] * z, y, z}, which);
      sum.weights[sum.terms++] = static_cast<Real>(in_y * in_z);
    });
  });
}

/// Uses the threads of this level: the coarse one has fewer cells.
template <class Real>
void CycleLevel<Real>::restrict_to(CycleLevel& coarse) {
  const std::int64_t rows = coarse.count_of_rows(), parts = std::min<std::int64_t>(rows, 4 * team_.threads());
  team_.run(parts, [&](std::int64_t part, int thread) {
    Row row = coarse.row_at(rows * part / parts);
    for (const std::int64_t end = rows * (part + 1) / parts; row.number < end; coarse.go_on(row))
      restrict_row(row, thread, coarse);
  });
}

template <class Real>
void CycleLevel<Real>::restrict_row(const Row& row_of_coarse, int thread, CycleLevel& coarse) {
  Real* const to[] = {coarse.half(coarse.b.data(), row_of_coarse, 0), coarse.half(coarse.b.data(), row_of_coarse, 1)};
  Real *const line = scratch(thread).halves.data(), *const made = coarse.scratch(thread).line();
  for (const int which : {0, 1}) {
    RowSum<Real> sum{.count = rows_.count(which)};
    gather(row_of_coarse, which, sum);
    kernels_.sum(sum, from_[0].is_halved ? line + rows_.begin(which) : to[which]);
  }
  if (!from_[0].is_halved) return;
  rows_.close_ring(line);
  const RestrictedRow<Real> restricted{
      coarse.rows_.cells(),
      line + rows_.begin(0),
      line + rows_.begin(1),
      {restricting_[0].data(), restricting_[1].data(), restricting_[2].data(), restricting_[3].data()}};
  kernels_.restrict_along(restricted, made);
  coarse.rows_.pack(made, 1, to[0], to[1]);
}

/// The coarse level interpolated across the outer axis to plane z; in plain x order if x is halved. Adjacent fine rows
/// use the same line.
template <class Real>
const Real* CycleLevel<Real>::coarse_line(std::uint32_t y, std::int64_t z, CycleLevel& coarse,
                                          Scratch& of_coarse) const {
  // on a periodic axis the last one is next to the first
  const std::size_t slot = y + 1 == coarse.cells_[1] ? 4 : y % 4;
  Real* const line = of_coarse.lines.data() + static_cast<std::int64_t>(slot) * coarse.line_stride() + room;
  const std::int64_t number = y + coarse.cells_[1] * z;
  if (std::exchange(of_coarse.lines_known[slot], number) == number) return line;
  const HalfRows& from = coarse.rows_;
  const AxisInterpolation& across = from_[2];
  const auto k = static_cast<std::size_t>(z);
  const bool is_halved = from_[0].is_halved;
  const Real* halves[2];
  for (const int which : {0, 1}) {
    const auto above = [&](std::uint32_t plane) {
      return coarse.half(coarse.x.data(), Row{y + coarse.cells_[1] * plane, y, plane}, which);
    };
    halves[which] = above(across.near[k]);
    if (is_halved && across.near_weight[k] == 1) continue;
    Real* to = (is_halved ? of_coarse.halves.data() : line) + from.begin(which);
    kernels_.sum({.count = from.count(which),
                  .terms = across.far_weight[k] == 0 ? 1 : 2,
                  .values = {halves[which], above(across.far[k])},
                  .weights = {static_cast<Real>(across.near_weight[k]), static_cast<Real>(across.far_weight[k])}},
                 to);
    halves[which] = to;
  }
  if (!is_halved) return line;
  kernels_.interleave(from.count(1), halves[0], halves[1], line);
  if (from.count(0) > from.count(1)) line[from.cells() - 1] = halves[0][from.count(1)];
  if (from.is_ring()) line[-1] = line[from.cells() - 1], line[from.cells()] = line[0];
  return line;
}

/// If the level is chequered only one colour is corrected: the other is smoothed next, which does not use its old
/// values.
template <class Real>
void CycleLevel<Real>::add_correction(const Row& row, int thread, int colour, CycleLevel& coarse, Real* x) const {
  Scratch& of_coarse = coarse.scratch(thread);
  const auto j = static_cast<std::size_t>(row.y);
  const AxisInterpolation& from = from_[1];
  const Real *near = coarse_line(from.near[j], row.z, coarse, of_coarse),
             *far = coarse_line(from.far[j], row.z, coarse, of_coarse);
  for (const int which : {0, 1}) {
    if (is_chequered_ && which != half_of(row, colour)) continue;
    const auto h = static_cast<std::size_t>(which);
    const bool is_halved = from_[0].is_halved;  // otherwise the coarse cell is the same one, with weight 1
    const std::int64_t begin = is_halved ? 0 : rows_.begin(which);
    kernels_.add_interpolated(
        {.count = rows_.count(which),
         .near = near_[h].data(),
         .far = far_[h].data(),
         .share = share_.row(row.number) + rows_.begin(which),
         .rows = {near + begin, far + begin},
         .weights = {static_cast<Real>(from.near_weight[j]), static_cast<Real>(from.far_weight[j])},
         .to_far = !is_halved   ? 0
                   : which == 0 ? -1
                                : 1},
        half(x, row, which));
    close_ring(x, row, which);
  }
}

template class CycleLevel<double>;
template class CycleLevel<float>;

}  // namespace dpde
