// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier/grid_waves.h"

#include <algorithm>
#include <utility>

#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

constexpr std::int64_t long_row = 2048 * sizeof(double);  // bytes
constexpr std::int64_t cells_at_once = 4096;

/// Rounds up to an odd number of blocks: the values of a column are then spread over all sets of the first-level cache
/// (512^2 cells: 1.10 times the time of the bare transforms; with an even number 1.4). Longer columns do not fit it,
/// and pairs of blocks are faster.
template <class Real>
std::int64_t with_gap(std::int64_t numbers) {
  constexpr std::int64_t width = LineWavesOf<Real>::width;
  const std::int64_t blocks = (numbers + width - 1) / width;
  if (numbers * static_cast<std::int64_t>(sizeof(Real)) < long_row) return width * (blocks | 1);
  const std::int64_t pairs = (blocks + 1) / 2;
  return 2 * width * (pairs % 4 == 0 ? pairs + 1 : pairs);
}

/// The same for planes, in which all rows are used.
template <class Real>
std::int64_t plane_with_gap(std::int64_t numbers) {
  constexpr std::int64_t width = LineWavesOf<Real>::width;
  return numbers % (8 * width) == 0 ? numbers + 2 * width : numbers;
}

template <class Real>
std::complex<Real>* complex(Real* values) {
  return reinterpret_cast<std::complex<Real>*>(values);
}

}  // namespace

template <class Real>
GridWavesOf<Real>::GridWavesOf(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides,
                               const Team& team)
    : cells_(cells) {
  if (cells[0] * cells[1] * cells[2] >= least_cells_of_team) team_ = team;
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] > 1) axes.push_back(axis);
  }
  if (axes.empty()) axes.push_back(0);
  if (axes.size() > 1) lines_.count = cells[axes[1]];
  if (axes.size() > 2) lines_.planes = cells[axes[2]];
  const Sides first = cells[axes.front()] == 1 ? Sides::even_even : sides[axes.front()];  // one cell: only the mean
  make_first(axes.front(), cells[axes.front()], first);
  for (std::size_t i = 1; i < axes.size(); ++i)
    make_stage(axes[i], cells[axes[i]], sides[axes[i]], i + 1 == axes.size());
}

template <class Real>
void GridWavesOf<Real>::make_first(std::size_t axis, std::int64_t cells, Sides sides) {
  lines_.axis = axis;
  are_complex_ = sides == Sides::periodic;
  modes_[axis] = are_complex_ ? cells / 2 + 1 : cells;
  lines_.row = row_ = with_gap<Real>(are_complex_ ? 2 * modes_[axis] : cells);
  lines_.plane = plane_with_gap<Real>(row_ * lines_.count);
  first_ = AlignedValuesOf<Real>(lines_.plane * lines_.planes);
  if (lines_.plane == row_ * lines_.count)
    lines_.count *= std::exchange(lines_.planes, 1);  // this also keeps lines of odd lengths aligned
  size_ = row_;
  lines_.block =
      std::min(lines_.count, LineWavesOf<Real>::width *
                                 std::max<std::int64_t>(1, cells_at_once / (LineWavesOf<Real>::width * cells)));
  const std::int64_t fewer = lines_.count % lines_.block;
  const auto ring = [&](std::int64_t lines) { return RealFftOf<Real>({cells, lines, 1, cells, 1, row_ / 2}); };
  for (int i = 0; i < team_.threads(); ++i) {
    FirstLines& own = firsts_.emplace_back();
    if (!are_complex_) {
      own.images.emplace(cells, sides, false, 1, LineWavesOf<Real>::width);
      continue;
    }
    own.ring.emplace(ring(lines_.block));
    if (fewer != 0) own.fewer.emplace(ring(fewer));
  }
  scale_ *= are_complex_ ? static_cast<double>(cells) : firsts_.front().images->scale();
  if (!are_complex_) {
    lines_.block = std::min(lines_.count, LineWavesOf<Real>::width);
    if (lines_.count == 1) size_ = cells * LineWavesOf<Real>::width;  // treated as a column
  }
  for (FirstLines& own : firsts_) own.values = AlignedValuesOf<Real>(lines_.block * cells);
  extents_.resize(static_cast<std::size_t>(lines_.planes * ((lines_.count + lines_.block - 1) / lines_.block)));
}

template <class Real>
void GridWavesOf<Real>::make_stage(std::size_t axis, std::int64_t cells, Sides sides, bool is_last) {
  std::int64_t outer = 1;
  for (std::size_t later = axis + 1; later < 3; ++later) outer *= cells_[later];
  const std::int64_t inner = size_, in_place = !is_last ? inner
                                               : inner % (2 * LineWavesOf<Real>::width) == 0
                                                   ? 2 * LineWavesOf<Real>::width
                                                   : LineWavesOf<Real>::width;
  Stage stage{axis, {}, outer, inner};
  for (int i = 0; i < team_.threads(); ++i) stage.of_threads.emplace_back(cells, sides, are_complex_, inner, in_place);
  const LineWavesOf<Real>& lines = stage.lines();
  stage.from = stage.to = second_ ? second_.get() : first_.get();
  stage.from_plane = lines_.plane;
  scale_ *= lines.scale();
  modes_[axis] = lines.modes();
  row_ *= lines.growth();
  size_ *= lines.growth() * lines.modes();
  stage.to_plane = lines.growth() == 1 ? lines_.plane : plane_with_gap<Real>(size_);
  if (lines.growth() == 2) {
    are_complex_ = true;
    if (!is_last) {
      second_ = AlignedValuesOf<Real>(outer * stage.to_plane);
      stage.to = second_.get();
    }
  }
  if (!is_last) size_ = stage.to_plane;
  stages_.push_back(std::move(stage));
}

template <class Real>
std::int64_t GridWavesOf<Real>::period(std::size_t axis) const {
  if (axis == lines_.axis) return has_images() ? firsts_.front().images->period() : cells_[axis];
  for (const Stage& stage : stages_) {
    if (stage.axis == axis) return stage.lines().period();
  }
  return 1;
}

/// Index of a factor, in the order in which the blocks of the last axis are multiplied.
template <class Real>
std::size_t GridWavesOf<Real>::number_of(std::int64_t row, std::int64_t along) const {
  if (stages_.empty()) return static_cast<std::size_t>(has_images() ? along * LineWavesOf<Real>::width : along);
  const LineWavesOf<Real>& last = stages_.back().lines();
  const std::int64_t numbers = are_complex_ ? 2 : 1, rows = stages_.size() == 1 ? 1 : stages_.front().lines().modes();
  const std::int64_t block = last.growth() * last.block() / numbers, column = row % rows * row_ / numbers + along;
  return static_cast<std::size_t>((column / block * last.modes() + row / rows) * block + column % block);
}

template <class Real>
void GridWavesOf<Real>::for_each(
    const std::function<void(std::size_t number, const std::array<std::int64_t, 3>& turns)>& f) const {
  std::array<std::int64_t, 3> turns{};
  for (std::int64_t number = 0; number < modes_[0] * modes_[1] * modes_[2]; ++number) {
    const std::array<std::int64_t, 3> mode{number % modes_[0], number / modes_[0] % modes_[1],
                                           number / modes_[0] / modes_[1]};
    turns[lines_.axis] = has_images() ? firsts_.front().images->turns(mode[lines_.axis]) : mode[lines_.axis];
    for (const Stage& stage : stages_) turns[stage.axis] = stage.lines().turns(mode[stage.axis]);
    f(number_of(number / modes_[lines_.axis], mode[lines_.axis]), turns);
  }
}

/// Calls f(index, transforms, first cell in a field, first mode, lines) for each block of lines along the first axis.
template <class Real>
template <class F>
void GridWavesOf<Real>::for_each_block_of_first(const F& f) {
  const std::int64_t blocks = (lines_.count + lines_.block - 1) / lines_.block;
  team_.run(lines_.planes * blocks, [&](std::int64_t number, int thread) {
    const std::int64_t plane = number / blocks, line = number % blocks * lines_.block;
    f(static_cast<std::size_t>(number), firsts_[static_cast<std::size_t>(thread)],
      (plane * lines_.count + line) * cells_[lines_.axis], first_.get() + plane * lines_.plane + line * lines_.row,
      std::min(lines_.block, lines_.count - line));
  });
}

template <class Real>
void GridWavesOf<Real>::first_forward(FirstLines& own, const Real* from, Real* to, std::int64_t lines) const {
  if (!own.images) return (lines == lines_.block ? own.ring : own.fewer)->forward(from, complex(to));
  own.images->read(from, 1, own.images->cells(), lines);
  own.images->forward();
  own.images->write_waves(to, 1, lines_.row, lines);
}

template <class Real>
void GridWavesOf<Real>::first_backward(FirstLines& own, Real* from, Real* to, std::int64_t lines) const {
  if (!own.images) return (lines == lines_.block ? own.ring : own.fewer)->backward(complex(from), to);
  own.images->read_waves(from, 1, lines_.row, lines);
  own.images->backward();
  own.images->write(to, 1, own.images->cells(), lines);
}

template <class Real>
void GridWavesOf<Real>::read(const Stage& stage, LineWavesOf<Real>& lines, Real* from) {
  if (lines.are_in_place()) return lines.place(from);
  lines.read(from, stage.inner, 1, LineWavesOf<Real>::width);
}

template <class Real>
void GridWavesOf<Real>::write(const Stage& stage, const LineWavesOf<Real>& lines, Real* to) {
  if (!lines.are_in_place()) lines.write(to, stage.inner, 1, LineWavesOf<Real>::width);
}

/// Calls f(lines, index of the block, its first index of `inner`, index of `outer`).
template <class Real>
template <class F>
void GridWavesOf<Real>::for_each_block(Stage& stage, const F& f) const {
  const std::int64_t block = stage.lines().block(), blocks = (stage.inner + block - 1) / block;
  team_.run(stage.outer * blocks, [&](std::int64_t number, int thread) {
    f(stage.of_threads[static_cast<std::size_t>(thread)], number % blocks, number % blocks * block, number / blocks);
  });
}

template <class Real>
void GridWavesOf<Real>::forward(Stage& stage) const {
  for_each_block(stage, [&](LineWavesOf<Real>& lines, std::int64_t, std::int64_t first, std::int64_t outer) {
    read(stage, lines, stage.from + outer * stage.from_plane + first);
    lines.forward();
    if (lines.are_in_place()) return;
    lines.write_waves(stage.to + outer * stage.to_plane + lines.growth() * first, lines.growth() * stage.inner, 1,
                      LineWavesOf<Real>::width);
  });
}

template <class Real>
void GridWavesOf<Real>::backward(Stage& stage) const {
  for_each_block(stage, [&](LineWavesOf<Real>& lines, std::int64_t, std::int64_t first, std::int64_t outer) {
    Real* const from = stage.to + outer * stage.to_plane + lines.growth() * first;
    if (lines.are_in_place()) {
      lines.place(from);
    } else {
      lines.read_waves(from, lines.growth() * stage.inner, 1, LineWavesOf<Real>::width);
    }
    lines.backward();
    write(stage, lines, stage.from + outer * stage.from_plane + first);
  });
}

template <class Real>
void GridWavesOf<Real>::multiply_last(Stage& stage, const Real* factors, bool have_phases) const {
  const LineWavesOf<Real>& shape = stage.lines();
  const std::int64_t of_block = shape.modes() * shape.growth() * shape.block() / (have_phases || !are_complex_ ? 1 : 2);
  for_each_block(stage, [&](LineWavesOf<Real>& lines, std::int64_t block, std::int64_t first, std::int64_t) {
    read(stage, lines, stage.from + first);
    lines.forward();
    lines.multiply(factors + block * of_block, have_phases);
    lines.backward();
    write(stage, lines, stage.from + first);
  });
}

/// On a grid with one axis.
template <class Real>
void GridWavesOf<Real>::multiply_line(const Real* field, const Real* factors, bool have_phases, Real* product) {
  FirstLines& own = firsts_.front();
  if (own.images) {
    own.images->read(field, 1, 1, 1);
    own.images->forward();
    own.images->multiply(factors, false);
    own.images->backward();
    return own.images->write(product, 1, 1, 1);
  }
  own.ring->forward(field, complex(first_.get()));
  for (std::int64_t i = 0; i < modes_[lines_.axis]; ++i) {
    complex(first_.get())[i] *=
        have_phases ? std::complex(factors[2 * i], factors[2 * i + 1]) : std::complex(factors[i], Real(0));
  }
  own.ring->backward(complex(first_.get()), product);
}

template <class Real>
void GridWavesOf<Real>::multiply_behind_first(const Real* factors, bool have_phases) {
  for (std::size_t i = 0; i + 1 < stages_.size(); ++i) forward(stages_[i]);
  multiply_last(stages_.back(), factors, have_phases);
  for (std::size_t i = stages_.size() - 1; i-- > 0;) backward(stages_[i]);
}

template <class Real>
void GridWavesOf<Real>::multiply(std::span<const Real> field, const Real* factors, bool have_phases,
                                 std::span<Real> product) {
  if (stages_.empty()) return multiply_line(field.data(), factors, have_phases, product.data());
  for_each_block_of_first([&](std::size_t, FirstLines& own, std::int64_t cell, Real* waves, std::int64_t lines) {
    first_forward(own, field.data() + cell, waves, lines);
  });
  multiply_behind_first(factors, have_phases);
  for_each_block_of_first([&](std::size_t, FirstLines& own, std::int64_t cell, Real* waves, std::int64_t lines) {
    first_backward(own, waves, product.data() + cell, lines);
  });
}

/// Combined in the order of the blocks.
template <class Real>
Extent GridWavesOf<Real>::extent() const {
  Extent all;
  for (const Extent& one : extents_) all.join(one);
  return all;
}

template <class Real>
std::optional<PassedRows> GridWavesOf<Real>::multiply_rows(const ReadRowsOf<Real>& read, const Real* factors,
                                                           bool have_phases, const WriteRowsOf<Real>& write) {
  const auto values_of = [&](FirstLines& own, std::int64_t lines) {
    return std::span(own.values.get(), static_cast<std::size_t>(lines * cells_[lines_.axis]));
  };
  for_each_block_of_first([&](std::size_t number, FirstLines& own, std::int64_t cell, Real* waves, std::int64_t lines) {
    const std::span<Real> values = values_of(own, lines);
    read(cell, values);
    extents_[number] = extent_of<Real>(values);
    if (!stages_.empty()) first_forward(own, values.data(), waves, lines);
  });
  const Extent of_field = extent();
  if (!of_field.template is_in_range<Real>()) return std::nullopt;
  Real* const line = firsts_.front().values.get();
  stages_.empty() ? multiply_line(line, factors, have_phases, line) : multiply_behind_first(factors, have_phases);
  for_each_block_of_first([&](std::size_t number, FirstLines& own, std::int64_t cell, Real* waves, std::int64_t lines) {
    const std::span<Real> values = values_of(own, lines);
    if (!stages_.empty()) first_backward(own, waves, values.data(), lines);
    extents_[number] = {.sums = {}, .is_finite = is_finite_block<Real>(values)};
    write(cell, values);
  });
  return PassedRows{of_field.sums, extent().is_finite};
}

template class GridWavesOf<double>;
template class GridWavesOf<float>;

}  // namespace dpde
