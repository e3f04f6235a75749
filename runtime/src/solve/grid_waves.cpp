// SPDX-License-Identifier: Apache-2.0
#include "solve/grid_waves.h"

#include <algorithm>
#include <utility>

namespace dpde {
namespace {

constexpr std::int64_t width = LineWaves::width;

constexpr std::int64_t long_row = 2048;

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

GridWaves::GridWaves(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides) : cells_(cells) {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] > 1) axes.push_back(axis);
  }
  if (axes.empty()) axes.push_back(0);
  if (axes.size() > 1) lines_ = cells[axes[1]];
  if (axes.size() > 2) planes_ = cells[axes[2]];
  const Sides first = cells[axes.front()] == 1 ? Sides::even_even : sides[axes.front()];  // of one cell: its mean
  make_first(axes.front(), cells[axes.front()], first);
  for (std::size_t i = 1; i < axes.size(); ++i)
    make_stage(axes[i], cells[axes[i]], sides[axes[i]], i + 1 == axes.size());
}

void GridWaves::make_first(std::size_t axis, std::int64_t cells, Sides sides) {
  first_axis_ = axis;
  are_complex_ = sides == Sides::periodic;
  modes_[axis] = are_complex_ ? cells / 2 + 1 : cells;
  first_row_ = row_ = with_gap(are_complex_ ? 2 * modes_[axis] : cells);
  plane_ = plane_with_gap(row_ * lines_);
  first_ = aligned_values(plane_ * planes_);
  if (plane_ == row_ * lines_) lines_ *= std::exchange(planes_, 1);  // which also keeps lines of odd lengths aligned
  size_ = row_;
  if (are_complex_) {
    ring_.emplace(RealLines{cells, lines_, 1, cells, 1, row_ / 2});
    scale_ *= static_cast<double>(cells);
  } else {
    images_.emplace(cells, sides, false, 1, width);
    scale_ *= images_->scale();
    if (lines_ == 1) size_ = cells * width;  // as a column
  }
}

void GridWaves::make_stage(std::size_t axis, std::int64_t cells, Sides sides, bool is_last) {
  std::int64_t outer = 1;
  for (std::size_t later = axis + 1; later < 3; ++later) outer *= cells_[later];
  const std::int64_t inner = size_, in_place = !is_last ? inner : inner % (2 * width) == 0 ? 2 * width : width;
  Stage stage{axis, LineWaves(cells, sides, are_complex_, inner, in_place), outer, inner};
  const LineWaves& lines = stage.lines;
  stage.from = stage.to = second_ ? second_.get() : first_.get();
  stage.from_plane = plane_;
  scale_ *= lines.scale();
  modes_[axis] = lines.modes();
  row_ *= lines.growth();
  size_ *= lines.growth() * lines.modes();
  stage.to_plane = lines.growth() == 1 ? plane_ : plane_with_gap(size_);
  if (lines.growth() == 2) {
    are_complex_ = true;
    if (!is_last) {
      second_ = aligned_values(outer * stage.to_plane);
      stage.to = second_.get();
    }
  }
  if (!is_last) size_ = stage.to_plane;
  stages_.push_back(std::move(stage));
}

std::int64_t GridWaves::period(std::size_t axis) const {
  if (axis == first_axis_) return images_ ? images_->period() : cells_[axis];
  for (const Stage& stage : stages_) {
    if (stage.axis == axis) return stage.lines.period();
  }
  return 1;
}

/// In the order in which the blocks of the last axis are multiplied.
std::size_t GridWaves::number_of(std::int64_t row, std::int64_t along) const {
  if (stages_.empty()) return static_cast<std::size_t>(images_ ? along * width : along);
  const LineWaves& last = stages_.back().lines;
  const std::int64_t doubles = are_complex_ ? 2 : 1, rows = stages_.size() == 1 ? 1 : stages_.front().lines.modes();
  const std::int64_t block = last.growth() * last.block() / doubles, column = row % rows * row_ / doubles + along;
  return static_cast<std::size_t>((column / block * last.modes() + row / rows) * block + column % block);
}

void GridWaves::for_each(
    const std::function<void(std::size_t number, const std::array<std::int64_t, 3>& turns)>& f) const {
  std::array<std::int64_t, 3> turns{};
  for (std::int64_t number = 0; number < modes_[0] * modes_[1] * modes_[2]; ++number) {
    const std::array<std::int64_t, 3> mode{number % modes_[0], number / modes_[0] % modes_[1],
                                           number / modes_[0] / modes_[1]};
    turns[first_axis_] = images_ ? images_->turns(mode[first_axis_]) : mode[first_axis_];
    for (const Stage& stage : stages_) turns[stage.axis] = stage.lines.turns(mode[stage.axis]);
    f(number_of(number / modes_[first_axis_], mode[first_axis_]), turns);
  }
}

void GridWaves::first_forward(const double* field) {
  double* to = first_.get();
  for (std::int64_t plane = 0; plane < planes_; ++plane, to += plane_) {
    if (ring_) ring_->forward(field, complex(to));
    for (std::int64_t line = 0; images_ && line < lines_; line += width) {
      const std::int64_t cells = images_->cells(), count = std::min(width, lines_ - line);
      images_->read(field + line * cells, 1, cells, count);
      images_->forward();
      images_->write_waves(to + line * first_row_, 1, first_row_, count);
    }
    field += lines_ * cells_[first_axis_];
  }
}

void GridWaves::first_backward(double* product) {
  double* from = first_.get();
  for (std::int64_t plane = 0; plane < planes_; ++plane, from += plane_) {
    if (ring_) ring_->backward(complex(from), product);
    for (std::int64_t line = 0; images_ && line < lines_; line += width) {
      const std::int64_t cells = images_->cells(), count = std::min(width, lines_ - line);
      images_->read_waves(from + line * first_row_, 1, first_row_, count);
      images_->backward();
      images_->write(product + line * cells, 1, cells, count);
    }
    product += lines_ * cells_[first_axis_];
  }
}

void GridWaves::read(Stage& stage, double* from) {
  if (stage.lines.are_in_place()) return stage.lines.place(from);
  stage.lines.read(from, stage.inner, 1, width);
}

void GridWaves::write(const Stage& stage, double* to) {
  if (!stage.lines.are_in_place()) stage.lines.write(to, stage.inner, 1, width);
}

void GridWaves::forward(Stage& stage) {
  LineWaves& lines = stage.lines;
  const std::int64_t inner = stage.inner, waves = lines.growth() * inner;
  for (std::int64_t outer = 0; outer < stage.outer; ++outer) {
    for (std::int64_t first = 0; first < inner; first += lines.block()) {
      double* const to = stage.to + outer * stage.to_plane + lines.growth() * first;
      read(stage, stage.from + outer * stage.from_plane + first);
      lines.forward();
      if (!lines.are_in_place()) lines.write_waves(to, waves, 1, width);
    }
  }
}

void GridWaves::backward(Stage& stage) {
  LineWaves& lines = stage.lines;
  const std::int64_t inner = stage.inner, waves = lines.growth() * inner;
  for (std::int64_t outer = 0; outer < stage.outer; ++outer) {
    for (std::int64_t first = 0; first < inner; first += lines.block()) {
      double* const from = stage.to + outer * stage.to_plane + lines.growth() * first;
      if (lines.are_in_place()) {
        lines.place(from);
      } else {
        lines.read_waves(from, waves, 1, width);
      }
      lines.backward();
      write(stage, stage.from + outer * stage.from_plane + first);
    }
  }
}

void GridWaves::multiply_last(Stage& stage, const double* factors, bool have_phases) const {
  LineWaves& lines = stage.lines;
  for (std::int64_t first = 0; first < stage.inner; first += lines.block()) {
    read(stage, stage.from + first);
    lines.forward();
    lines.multiply(factors, have_phases);
    lines.backward();
    write(stage, stage.from + first);
    factors += lines.modes() * lines.growth() * lines.block() / (have_phases || !are_complex_ ? 1 : 2);
  }
}

/// On a grid of one axis.
void GridWaves::multiply_line(const double* field, const double* factors, bool have_phases, double* product) {
  if (images_) {
    images_->read(field, 1, 1, 1);
    images_->forward();
    images_->multiply(factors, false);
    images_->backward();
    return images_->write(product, 1, 1, 1);
  }
  ring_->forward(field, complex(first_.get()));
  for (std::int64_t i = 0; i < modes_[first_axis_]; ++i) {
    complex(first_.get())[i] *=
        have_phases ? std::complex(factors[2 * i], factors[2 * i + 1]) : std::complex(factors[i], 0.0);
  }
  ring_->backward(complex(first_.get()), product);
}

void GridWaves::multiply(std::span<const double> field, const double* factors, bool have_phases,
                         std::span<double> product) {
  if (stages_.empty()) return multiply_line(field.data(), factors, have_phases, product.data());
  first_forward(field.data());
  for (std::size_t i = 0; i + 1 < stages_.size(); ++i) forward(stages_[i]);
  multiply_last(stages_.back(), factors, have_phases);
  for (std::size_t i = stages_.size() - 1; i-- > 0;) backward(stages_[i]);
  first_backward(product.data());
}

}  // namespace dpde
