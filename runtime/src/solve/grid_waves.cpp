// SPDX-License-Identifier: Apache-2.0
#include "solve/grid_waves.h"

#include <algorithm>
#include <utility>

#include "solve/vector_parts.h"

namespace dpde {
namespace {

constexpr std::int64_t width = LineWaves::width;

constexpr std::int64_t long_row = 2048;
constexpr std::int64_t cells_at_once = 4096;

/// Whole blocks, and an odd number of them: the values of a column of so many cells then fall into all places of the
/// first cache (512^2 cells: 1.10 times the bare transforms, with an even number 1.4). Columns of more do not fit it,
/// and pairs of blocks are faster.
std::int64_t with_gap(std::int64_t doubles) {
  const std::int64_t blocks = (doubles + width - 1) / width;
  if (doubles < long_row) return width * (blocks | 1);
  const std::int64_t pairs = (blocks + 1) / 2;
  return 2 * width * (pairs % 4 == 0 ? pairs + 1 : pairs);
}

/// The same for planes, all of whose rows are used.
std::int64_t plane_with_gap(std::int64_t doubles) { return doubles % (8 * width) == 0 ? doubles + 2 * width : doubles; }

std::complex<double>* complex(double* values) { return reinterpret_cast<std::complex<double>*>(values); }

}  // namespace

GridWaves::GridWaves(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides, const Team& team)
    : cells_(cells) {
  if (cells[0] * cells[1] * cells[2] >= least_cells_of_team) team_ = team;
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] > 1) axes.push_back(axis);
  }
  if (axes.empty()) axes.push_back(0);
  if (axes.size() > 1) lines_.count = cells[axes[1]];
  if (axes.size() > 2) lines_.planes = cells[axes[2]];
  const Sides first = cells[axes.front()] == 1 ? Sides::even_even : sides[axes.front()];  // of one cell: its mean
  make_first(axes.front(), cells[axes.front()], first);
  for (std::size_t i = 1; i < axes.size(); ++i)
    make_stage(axes[i], cells[axes[i]], sides[axes[i]], i + 1 == axes.size());
}

void GridWaves::make_first(std::size_t axis, std::int64_t cells, Sides sides) {
  lines_.axis = axis;
  are_complex_ = sides == Sides::periodic;
  modes_[axis] = are_complex_ ? cells / 2 + 1 : cells;
  lines_.row = row_ = with_gap(are_complex_ ? 2 * modes_[axis] : cells);
  lines_.plane = plane_with_gap(row_ * lines_.count);
  first_ = AlignedValues(lines_.plane * lines_.planes);
  if (lines_.plane == row_ * lines_.count)
    lines_.count *= std::exchange(lines_.planes, 1);  // which also keeps lines of odd lengths aligned
  size_ = row_;
  lines_.block = std::min(lines_.count, width * std::max<std::int64_t>(1, cells_at_once / (width * cells)));
  const std::int64_t fewer = lines_.count % lines_.block;
  const auto ring = [&](std::int64_t lines) { return RealFft({cells, lines, 1, cells, 1, row_ / 2}); };
  for (int i = 0; i < team_.threads(); ++i) {
    FirstLines& own = firsts_.emplace_back();
    if (!are_complex_) {
      own.images.emplace(cells, sides, false, 1, width);
      continue;
    }
    own.ring.emplace(ring(lines_.block));
    if (fewer != 0) own.fewer.emplace(ring(fewer));
  }
  scale_ *= are_complex_ ? static_cast<double>(cells) : firsts_.front().images->scale();
  if (!are_complex_) {
    lines_.block = std::min(lines_.count, width);
    if (lines_.count == 1) size_ = cells * width;  // as a column
  }
  for (FirstLines& own : firsts_) own.values = AlignedValues(lines_.block * cells);
  extents_.resize(static_cast<std::size_t>(lines_.planes * ((lines_.count + lines_.block - 1) / lines_.block)));
}

void GridWaves::make_stage(std::size_t axis, std::int64_t cells, Sides sides, bool is_last) {
  std::int64_t outer = 1;
  for (std::size_t later = axis + 1; later < 3; ++later) outer *= cells_[later];
  const std::int64_t inner = size_, in_place = !is_last ? inner : inner % (2 * width) == 0 ? 2 * width : width;
  Stage stage{axis, {}, outer, inner};
  for (int i = 0; i < team_.threads(); ++i) stage.of_threads.emplace_back(cells, sides, are_complex_, inner, in_place);
  const LineWaves& lines = stage.lines();
  stage.from = stage.to = second_ ? second_.get() : first_.get();
  stage.from_plane = lines_.plane;
  scale_ *= lines.scale();
  modes_[axis] = lines.modes();
  row_ *= lines.growth();
  size_ *= lines.growth() * lines.modes();
  stage.to_plane = lines.growth() == 1 ? lines_.plane : plane_with_gap(size_);
  if (lines.growth() == 2) {
    are_complex_ = true;
    if (!is_last) {
      second_ = AlignedValues(outer * stage.to_plane);
      stage.to = second_.get();
    }
  }
  if (!is_last) size_ = stage.to_plane;
  stages_.push_back(std::move(stage));
}

std::int64_t GridWaves::period(std::size_t axis) const {
  if (axis == lines_.axis) return has_images() ? firsts_.front().images->period() : cells_[axis];
  for (const Stage& stage : stages_) {
    if (stage.axis == axis) return stage.lines().period();
  }
  return 1;
}

/// In the order in which the blocks of the last axis are multiplied.
std::size_t GridWaves::number_of(std::int64_t row, std::int64_t along) const {
  if (stages_.empty()) return static_cast<std::size_t>(has_images() ? along * width : along);
  const LineWaves& last = stages_.back().lines();
  const std::int64_t doubles = are_complex_ ? 2 : 1, rows = stages_.size() == 1 ? 1 : stages_.front().lines().modes();
  const std::int64_t block = last.growth() * last.block() / doubles, column = row % rows * row_ / doubles + along;
  return static_cast<std::size_t>((column / block * last.modes() + row / rows) * block + column % block);
}

void GridWaves::for_each(
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

/// f(number, transforms, first cell in a field, first wave, lines) of each block of lines along the first axis.
template <class F>
void GridWaves::for_each_block_of_first(const F& f) {
  const std::int64_t blocks = (lines_.count + lines_.block - 1) / lines_.block;
  team_.run(lines_.planes * blocks, [&](std::int64_t number, int thread) {
    const std::int64_t plane = number / blocks, line = number % blocks * lines_.block;
    f(static_cast<std::size_t>(number), firsts_[static_cast<std::size_t>(thread)],
      (plane * lines_.count + line) * cells_[lines_.axis], first_.get() + plane * lines_.plane + line * lines_.row,
      std::min(lines_.block, lines_.count - line));
  });
}

void GridWaves::first_forward(FirstLines& own, const double* from, double* to, std::int64_t lines) const {
  if (!own.images) return (lines == lines_.block ? own.ring : own.fewer)->forward(from, complex(to));
  own.images->read(from, 1, own.images->cells(), lines);
  own.images->forward();
  own.images->write_waves(to, 1, lines_.row, lines);
}

void GridWaves::first_backward(FirstLines& own, double* from, double* to, std::int64_t lines) const {
  if (!own.images) return (lines == lines_.block ? own.ring : own.fewer)->backward(complex(from), to);
  own.images->read_waves(from, 1, lines_.row, lines);
  own.images->backward();
  own.images->write(to, 1, own.images->cells(), lines);
}

void GridWaves::read(const Stage& stage, LineWaves& lines, double* from) {
  if (lines.are_in_place()) return lines.place(from);
  lines.read(from, stage.inner, 1, width);
}

void GridWaves::write(const Stage& stage, const LineWaves& lines, double* to) {
  if (!lines.are_in_place()) lines.write(to, stage.inner, 1, width);
}

/// f(lines, number of the block, its first double of `inner`, which of `outer`)
template <class F>
void GridWaves::for_each_block(Stage& stage, const F& f) const {
  const std::int64_t block = stage.lines().block(), blocks = (stage.inner + block - 1) / block;
  team_.run(stage.outer * blocks, [&](std::int64_t number, int thread) {
    f(stage.of_threads[static_cast<std::size_t>(thread)], number % blocks, number % blocks * block, number / blocks);
  });
}

void GridWaves::forward(Stage& stage) const {
  for_each_block(stage, [&](LineWaves& lines, std::int64_t, std::int64_t first, std::int64_t outer) {
    read(stage, lines, stage.from + outer * stage.from_plane + first);
    lines.forward();
    if (lines.are_in_place()) return;
    lines.write_waves(stage.to + outer * stage.to_plane + lines.growth() * first, lines.growth() * stage.inner, 1,
                      width);
  });
}

void GridWaves::backward(Stage& stage) const {
  for_each_block(stage, [&](LineWaves& lines, std::int64_t, std::int64_t first, std::int64_t outer) {
    double* const from = stage.to + outer * stage.to_plane + lines.growth() * first;
    if (lines.are_in_place()) {
      lines.place(from);
    } else {
      lines.read_waves(from, lines.growth() * stage.inner, 1, width);
    }
    lines.backward();
    write(stage, lines, stage.from + outer * stage.from_plane + first);
  });
}

void GridWaves::multiply_last(Stage& stage, const double* factors, bool have_phases) const {
  const LineWaves& shape = stage.lines();
  const std::int64_t of_block = shape.modes() * shape.growth() * shape.block() / (have_phases || !are_complex_ ? 1 : 2);
  for_each_block(stage, [&](LineWaves& lines, std::int64_t block, std::int64_t first, std::int64_t) {
    read(stage, lines, stage.from + first);
    lines.forward();
    lines.multiply(factors + block * of_block, have_phases);
    lines.backward();
    write(stage, lines, stage.from + first);
  });
}

/// On a grid of one axis.
void GridWaves::multiply_line(const double* field, const double* factors, bool have_phases, double* product) {
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
        have_phases ? std::complex(factors[2 * i], factors[2 * i + 1]) : std::complex(factors[i], 0.0);
  }
  own.ring->backward(complex(first_.get()), product);
}

void GridWaves::multiply_behind_first(const double* factors, bool have_phases) {
  for (std::size_t i = 0; i + 1 < stages_.size(); ++i) forward(stages_[i]);
  multiply_last(stages_.back(), factors, have_phases);
  for (std::size_t i = stages_.size() - 1; i-- > 0;) backward(stages_[i]);
}

void GridWaves::multiply(std::span<const double> field, const double* factors, bool have_phases,
                         std::span<double> product) {
  if (stages_.empty()) return multiply_line(field.data(), factors, have_phases, product.data());
  for_each_block_of_first([&](std::size_t, FirstLines& own, std::int64_t cell, double* waves, std::int64_t lines) {
    first_forward(own, field.data() + cell, waves, lines);
  });
  multiply_behind_first(factors, have_phases);
  for_each_block_of_first([&](std::size_t, FirstLines& own, std::int64_t cell, double* waves, std::int64_t lines) {
    first_backward(own, waves, product.data() + cell, lines);
  });
}

/// In the order of the blocks.
Extent GridWaves::extent() const {
  Extent all;
  for (const Extent& one : extents_) all.join(one);
  return all;
}

std::optional<GridWaves::Passed> GridWaves::multiply_rows(const ReadRows& read, const double* factors, bool have_phases,
                                                          const WriteRows& write) {
  const auto values_of = [&](FirstLines& own, std::int64_t lines) {
    return std::span(own.values.get(), static_cast<std::size_t>(lines * cells_[lines_.axis]));
  };
  for_each_block_of_first(
      [&](std::size_t number, FirstLines& own, std::int64_t cell, double* waves, std::int64_t lines) {
        const std::span<double> values = values_of(own, lines);
        read(cell, values);
        extents_[number] = extent_of(values);
        if (!stages_.empty()) first_forward(own, values.data(), waves, lines);
      });
  const Extent of_field = extent();
  if (!of_field.is_in_range()) return std::nullopt;
  double* const line = firsts_.front().values.get();
  stages_.empty() ? multiply_line(line, factors, have_phases, line) : multiply_behind_first(factors, have_phases);
  for_each_block_of_first(
      [&](std::size_t number, FirstLines& own, std::int64_t cell, double* waves, std::int64_t lines) {
        const std::span<double> values = values_of(own, lines);
        if (!stages_.empty()) first_backward(own, waves, values.data(), lines);
        extents_[number] = extent_of(values);
        write(cell, values);
      });
  return Passed{of_field.sums, extent().is_finite};
}

}  // namespace dpde
