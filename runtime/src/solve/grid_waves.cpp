// SPDX-License-Identifier: Apache-2.0
#include "solve/grid_waves.h"

#include <algorithm>

namespace dpde {
namespace {

constexpr std::int64_t width = LineWaves::width;

/// Whole blocks, and no columns whose values fall into the same few places of the cache.
std::int64_t with_gap(std::int64_t doubles) {
  const std::int64_t blocks = (doubles + width - 1) / width;
  return width * (blocks % 8 == 0 ? blocks + 1 : blocks);
}

std::complex<double>* complex(double* values) { return reinterpret_cast<std::complex<double>*>(values); }

}  // namespace

GridWaves::GridWaves(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides) : cells_(cells) {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cells[axis] > 1) axes.push_back(axis);
  }
  if (axes.empty()) axes.push_back(0);
  for (const std::size_t axis : axes) {
    if (axis != axes.front()) lines_ *= cells[axis];
  }
  make_first(axes.front(), cells[axes.front()], sides[axes.front()]);
  for (std::size_t i = 1; i < axes.size(); ++i)
    make_stage(axes[i], cells[axes[i]], sides[axes[i]], i + 1 == axes.size());
}

void GridWaves::make_first(std::size_t axis, std::int64_t cells, Sides sides) {
  first_axis_ = axis;
  are_complex_ = sides == Sides::periodic;
  modes_[axis] = are_complex_ ? cells / 2 + 1 : cells;
  row_ = with_gap(are_complex_ ? 2 * modes_[axis] : cells);
  if (are_complex_) {
    ring_.emplace(RealLines{cells, lines_, 1, cells, 1, row_ / 2});
    scale_ *= static_cast<double>(cells);
  } else {
    images_.emplace(cells, sides, false);
    scale_ *= images_->scale();
    if (lines_ == 1) row_ = width, rows_ = cells;  // as a column
  }
  first_row_ = row_;
  first_ = aligned_values(row_ * lines_);
}

void GridWaves::make_stage(std::size_t axis, std::int64_t cells, Sides sides, bool is_last) {
  double* const from = second_ ? second_.get() : first_.get();
  const std::int64_t inner = rows_ * row_;
  std::int64_t outer = 1;
  for (std::size_t later = axis + 1; later < 3; ++later) outer *= cells_[later];
  LineWaves lines(cells, sides, are_complex_);
  scale_ *= lines.scale();
  modes_[axis] = lines.modes();
  rows_ *= lines.modes();
  double* to = from;
  if (lines.growth() == 2) {
    are_complex_ = true;
    row_ *= 2;
    if (!is_last) {
      second_ = aligned_values(outer * rows_ * row_);
      to = second_.get();
    }
  }
  stages_.push_back({axis, std::move(lines), outer, inner, from, to});
}

std::int64_t GridWaves::period(std::size_t axis) const {
  if (axis == first_axis_) return images_ ? images_->period() : cells_[axis];
  for (const Stage& stage : stages_) {
    if (stage.axis == axis) return stage.lines.period();
  }
  return 1;
}

void GridWaves::for_each(
    const std::function<void(std::size_t place, const std::array<std::int64_t, 3>& turns)>& f) const {
  const bool is_column = images_ && lines_ == 1;
  const std::int64_t step = is_column ? width : are_complex_ ? 2 : 1;
  std::array<std::int64_t, 3> turns{};
  for (std::int64_t number = 0; number < modes_[0] * modes_[1] * modes_[2]; ++number) {
    const std::array<std::int64_t, 3> mode{number % modes_[0], number / modes_[0] % modes_[1],
                                           number / modes_[0] / modes_[1]};
    turns[first_axis_] = images_ ? images_->turns(mode[first_axis_]) : mode[first_axis_];
    for (const Stage& stage : stages_) turns[stage.axis] = stage.lines.turns(mode[stage.axis]);
    const std::int64_t along = mode[first_axis_], row = number / modes_[first_axis_];
    f(static_cast<std::size_t>(along * step + row * row_), turns);
  }
}

void GridWaves::first_forward(const double* field) {
  if (ring_) return ring_->forward(field, complex(first_.get()));
  const std::int64_t cells = images_->cells();
  for (std::int64_t line = 0; line < lines_; line += width) {
    const std::int64_t count = std::min(width, lines_ - line);
    images_->read(field + line * cells, 1, cells, count);
    images_->forward();
    images_->write_waves(first_.get() + line * first_row_, 1, first_row_, count);
  }
}

void GridWaves::first_backward(double* product) {
  if (ring_) return ring_->backward(complex(first_.get()), product);
  const std::int64_t cells = images_->cells();
  for (std::int64_t line = 0; line < lines_; line += width) {
    const std::int64_t count = std::min(width, lines_ - line);
    images_->read_waves(first_.get() + line * first_row_, 1, first_row_, count);
    images_->backward();
    images_->write(product + line * cells, 1, cells, count);
  }
}

void GridWaves::forward(Stage& stage) {
  LineWaves& lines = stage.lines;
  const std::int64_t inner = stage.inner, waves = lines.growth() * inner;
  for (std::int64_t outer = 0; outer < stage.outer; ++outer) {
    for (std::int64_t first = 0; first < inner; first += width) {
      lines.read(stage.from + outer * lines.cells() * inner + first, inner, 1, width);
      lines.forward();
      lines.write_waves(stage.to + outer * lines.modes() * waves + lines.growth() * first, waves, 1, width);
    }
  }
}

void GridWaves::backward(Stage& stage) {
  LineWaves& lines = stage.lines;
  const std::int64_t inner = stage.inner, waves = lines.growth() * inner;
  for (std::int64_t outer = 0; outer < stage.outer; ++outer) {
    for (std::int64_t first = 0; first < inner; first += width) {
      lines.read_waves(stage.to + outer * lines.modes() * waves + lines.growth() * first, waves, 1, width);
      lines.backward();
      lines.write(stage.from + outer * lines.cells() * inner + first, inner, 1, width);
    }
  }
}

void GridWaves::multiply_last(Stage& stage, const double* factors, bool have_phases) const {
  LineWaves& lines = stage.lines;
  const std::int64_t growth = lines.growth();
  for (std::int64_t first = 0; first < stage.inner; first += width) {
    lines.read(stage.from + first, stage.inner, 1, width);
    lines.forward();
    lines.multiply(factors + growth * first, growth * stage.inner, have_phases);
    lines.backward();
    lines.write(stage.from + first, stage.inner, 1, width);
  }
}

/// On a grid of one axis.
void GridWaves::multiply_line(const double* field, const double* factors, bool have_phases, double* product) {
  if (images_) {
    images_->read(field, 1, 1, 1);
    images_->forward();
    images_->multiply(factors, width, false);
    images_->backward();
    return images_->write(product, 1, 1, 1);
  }
  ring_->forward(field, complex(first_.get()));
  for (std::int64_t i = 0; i < row_; i += 2) {
    const std::complex<double> factor =
        have_phases ? std::complex(factors[i], factors[i + 1]) : std::complex(factors[i], 0.0);
    complex(first_.get())[i / 2] *= factor;
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
