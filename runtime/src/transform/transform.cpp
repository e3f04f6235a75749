// SPDX-License-Identifier: Apache-2.0
#include "transform/transform.h"

#include <algorithm>
#include <optional>
#include <type_traits>

#include "dpde/runtime/layout.h"
#include "grid/real.h"
#include "solve/operator/vector_parts.h"
#include "transform/fft.h"

namespace dpde {
namespace {

constexpr int64_t lines_at_once = 8;

std::array<int64_t, 3> dense_strides(const std::array<int64_t, 3>& lengths) {
  return {1, lengths[0], lengths[0] * lengths[1]};
}

/// Copies between values with stride `step` and lines of doubles.
template <class Real>
void gather(const Real* from, int64_t step, std::vector<double>& line) {
  for (std::size_t i = 0; i < line.size(); ++i) line[i] = static_cast<double>(from[static_cast<int64_t>(i) * step]);
}
template <class Real>
void scatter(const std::vector<double>& line, Real* to, int64_t step) {
  for (std::size_t i = 0; i < line.size(); ++i) to[static_cast<int64_t>(i) * step] = static_cast<Real>(line[i]);
}

}  // namespace

struct FieldTransform::Lines {
  std::vector<double> real;
  std::vector<Complex> waves;                              // of a block
  std::optional<RealFft> first;                            // between `real` and a line of waves
  std::array<std::optional<ComplexFft>, 3> others, fewer;  // for the lines of a block, and for the last, smaller block

  explicit Lines(const FieldTransform& of) : real(static_cast<std::size_t>(of.waves_.cells[of.first_])) {
    const std::array<int64_t, 3> strides = dense_strides(of.waves_.modes);
    const int64_t n = of.waves_.cells[of.first_], step = of.is_along_one_axis() ? 1 : strides[of.first_];
    waves.resize(static_cast<std::size_t>(lines_at_once * of.waves_.length()));
    if (of.goes_along(of.first_)) first.emplace(RealLines{n, 1, 1, n, step, 1});
    for (std::size_t axis = of.first_ + 1; axis < 3; ++axis) {
      if (!of.goes_along(axis)) continue;
      const int64_t length = of.waves_.modes[axis], width = of.waves_.modes[0];
      const auto make = [&](int64_t lines) {
        ComplexLines made = lines_in_place(length, lines, strides[axis], 1);
        if (axis == of.waves_.along) made.wave_step = 1, made.wave_apart = length;
        return made;
      };
      if (width >= lines_at_once) others[axis].emplace(make(lines_at_once));
      if (width % lines_at_once != 0) fewer[axis].emplace(make(width % lines_at_once));
    }
  }
  ComplexFft& along(std::size_t axis, int64_t lines) { return lines < lines_at_once ? *fewer[axis] : *others[axis]; }
};

/// Offsets of the lines of an array with these lengths and strides.
struct FieldTransform::LineBegins {
  std::array<int64_t, 2> counts, strides;
  LineBegins(const std::array<int64_t, 3>& lengths, const std::array<int64_t, 3>& strides_of, std::size_t axis) {
    for (std::size_t other = 0, i = 0; other < 3; ++other) {
      if (other == axis) continue;
      counts[i] = lengths[other];
      strides[i++] = strides_of[other];
    }
  }
  int64_t count() const { return counts[0] * counts[1]; }
  int64_t begin(int64_t line) const { return line % counts[0] * strides[0] + line / counts[0] * strides[1]; }
};

struct FieldTransform::Block {
  int64_t line, lines;
  Block(int64_t number, int64_t side_by_side) {
    const int64_t blocks = count_in(side_by_side), begin = number % blocks * lines_at_once;
    line = number / blocks * side_by_side + begin;
    lines = std::min(lines_at_once, side_by_side - begin);
  }
  static int64_t count_in(int64_t side_by_side) { return (side_by_side + lines_at_once - 1) / lines_at_once; }
};

FieldTransform::FieldTransform() = default;
FieldTransform::~FieldTransform() = default;
FieldTransform::FieldTransform(FieldTransform&&) noexcept = default;
FieldTransform& FieldTransform::operator=(FieldTransform&&) noexcept = default;

FieldTransform::FieldTransform(const dpde_transform& transform, const dpde_layout& layout, const Team& team,
                               FieldTransform* before)
    : transform_(transform), real_(layout.real) {
  choose_axes(layout);
  if (waves_.cells[0] * waves_.cells[1] * waves_.cells[2] >= least_cells_of_team) team_ = team;
  make_operands();
  const int64_t size = 2 * waves_.count() * waves_.length();
  if (before != nullptr && shares_waves_of(*before)) {
    if (!before->kept_) before->kept_ = std::make_shared<AlignedValues>(size);
    kept_ = before->kept_;
    are_made_before_ = true;
  }
  if (!is_along_one_axis()) half_way_ = AlignedValues(size);
  if (operands_.size() > 1) sum_ = AlignedValues(size);
  for (int i = 0; i < team_.threads(); ++i) lines_.emplace_back(*this);
}

/// An axis of one cell has a single mode, which is its own transform: it becomes `first_` only if there are no others.
/// If no axis is transformed (as the linear part of a reaction has no derivatives), each value is just multiplied.
void FieldTransform::choose_axes(const dpde_layout& layout) {
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(layout.rank); ++axis) {
    waves_.cells[axis] = layout.cells[axis];
    waves_.axes[axis] = transform_.axes[axis] != 0;
    stride_[axis] = layout.stride[axis];
  }
  for (std::size_t axis = 3; axis-- > 0;) {
    if (waves_.axes[axis] && (goes_along(axis) || !goes_along(first_))) first_ = axis;
  }
  waves_.along = first_;
  for (std::size_t axis = first_ + 1; axis < 3; ++axis) {
    if (goes_along(axis)) waves_.along = axis;
  }
  waves_.modes = waves_.cells;
  if (goes_along(first_)) waves_.modes[first_] = waves_.cells[first_] / 2 + 1;
}

void FieldTransform::make_operands() {
  std::vector<int32_t> fields;
  for (int32_t i = 0; i < transform_.term_count; ++i) {
    if (!std::ranges::count(fields, transform_.terms[i].field)) fields.push_back(transform_.terms[i].field);
  }
  for (const int32_t field : fields) {
    std::vector<const dpde_transform_term*> terms;
    for (int32_t i = 0; i < transform_.term_count; ++i) {
      if (transform_.terms[i].field == field) terms.push_back(&transform_.terms[i]);
    }
    operands_.push_back({field, WaveMultipliers(waves_, std::move(terms))});
  }
}

bool FieldTransform::shares_waves_of(const FieldTransform& before) const {
  const bool are_single = operands_.size() == 1 && before.operands_.size() == 1;
  return are_single && operands_.front().field == before.operands_.front().field &&
         before.transform_.result != operands_.front().field &&
         std::ranges::equal(transform_.axes, before.transform_.axes);
}

std::int64_t FieldTransform::bytes() const {
  std::int64_t values = half_way_.count() + sum_.count();
  if (kept_ && !are_made_before_) values += kept_->count();
  for (const Lines& lines : lines_) values += static_cast<std::int64_t>(2 * lines.waves.size() + lines.real.size());
  for (const Operand& operand : operands_) values += operand.multipliers.count();
  return values * static_cast<std::int64_t>(sizeof(double));
}

/// Contiguous doubles are transformed in place of a copy.
template <class Real>
void FieldTransform::read_line(const Real* from, Lines& own, Complex* waves) const {
  if constexpr (std::is_same_v<Real, double>) {
    if (own.first && stride_[first_] == 1 && is_aligned(from)) return own.first->forward(from, waves);
  }
  gather(from, stride_[first_], own.real);
  if (own.first) {
    own.first->forward(own.real.data(), waves);
  } else {
    std::ranges::copy(own.real, waves);
  }
}

template <class Real>
void FieldTransform::write_line(Complex* waves, Lines& own, Real* to) const {
  if constexpr (std::is_same_v<Real, double>) {
    if (own.first && stride_[first_] == 1 && is_aligned(to)) return own.first->backward(waves, to);
  }
  if (own.first) {
    own.first->backward(waves, own.real.data());
  } else {
    std::ranges::transform(waves, waves + own.real.size(), own.real.begin(), [](Complex wave) { return wave.real(); });
  }
  scatter(own.real, to, stride_[first_]);
}

template <class Real>
void FieldTransform::first_forward(const Real* from) {
  const LineBegins source(waves_.cells, stride_, first_), target(waves_.modes, dense_strides(waves_.modes), first_);
  team_.run(source.count(), [&](int64_t line, int thread) {
    read_line(from + source.begin(line), lines_[static_cast<std::size_t>(thread)],
              half_way_.complex() + target.begin(line));
  });
}

template <class Real>
void FieldTransform::first_backward(Real* to) {
  const LineBegins source(waves_.modes, dense_strides(waves_.modes), first_), target(waves_.cells, stride_, first_);
  team_.run(source.count(), [&](int64_t line, int thread) {
    write_line(half_way_.complex() + source.begin(line), lines_[static_cast<std::size_t>(thread)],
               to + target.begin(line));
  });
}

/// Transforms in place along the axes between the first and the last one.
void FieldTransform::between(std::size_t axis, bool is_forward) {
  const LineBegins lines(waves_.modes, dense_strides(waves_.modes), axis);
  team_.run(Block::count_in(lines.counts[0]) * lines.counts[1], [&](int64_t number, int thread) {
    const Block block(number, lines.counts[0]);
    ComplexFft& fft = lines_[static_cast<std::size_t>(thread)].along(axis, block.lines);
    Complex* const begin = half_way_.complex() + lines.begin(block.line);
    if (is_forward) {
      fft.forward(begin);
    } else {
      fft.backward(begin);
    }
  });
}

template <class Real>
void FieldTransform::last_forward(const Block& block, const Real* from, Lines& own, Complex* waves) {
  if (!is_along_one_axis()) {
    const LineBegins lines(waves_.modes, dense_strides(waves_.modes), waves_.along);
    return own.along(waves_.along, block.lines).forward(half_way_.complex() + lines.begin(block.line), waves);
  }
  const LineBegins lines(waves_.cells, stride_, first_);
  for (int64_t i = 0; i < block.lines; ++i)
    read_line(from + lines.begin(block.line + i), own, waves + i * waves_.length());
}

template <class Real>
void FieldTransform::last_backward(const Block& block, Complex* waves, Lines& own, Real* to) {
  if (!is_along_one_axis()) {
    const LineBegins lines(waves_.modes, dense_strides(waves_.modes), waves_.along);
    return own.along(waves_.along, block.lines).backward(waves, half_way_.complex() + lines.begin(block.line));
  }
  const LineBegins lines(waves_.cells, stride_, first_);
  for (int64_t i = 0; i < block.lines; ++i)
    write_line(waves + i * waves_.length(), own, to + lines.begin(block.line + i));
}

template <class Real>
void FieldTransform::multiply_waves(std::size_t number, const Real* from, Real* to) {
  const int64_t side_by_side = waves_.side_by_side();
  team_.run(Block::count_in(side_by_side) * (waves_.count() / side_by_side), [&](int64_t part, int thread) {
    const Block block(part, side_by_side);
    Lines& own = lines_[static_cast<std::size_t>(thread)];
    const int64_t begin = block.line * waves_.length();
    Complex* const waves = kept_ ? kept_->complex() + begin : own.waves.data();
    if (!are_made_before_) last_forward(block, from, own, waves);
    Complex* const sum = !sum_ ? own.waves.data() : sum_.complex() + begin;
    operands_[number].multipliers.multiply(block.line, block.lines, waves, sum, number > 0);
    if (number + 1 == operands_.size()) last_backward(block, sum, own, to);
  });
}

void FieldTransform::run(void* const* fields, const double* uniforms) {
  with_real(real_, [&](auto real) {
    using Real = decltype(real);
    auto* const to = static_cast<Real*>(fields[transform_.result]);
    for (std::size_t i = 0; i < operands_.size(); ++i) {
      operands_[i].multipliers.update(uniforms, team_);
      const auto* const from = static_cast<const Real*>(fields[operands_[i].field]);
      if (!are_made_before_ && !is_along_one_axis()) {
        first_forward(from);
        for (std::size_t axis = first_ + 1; axis < waves_.along; ++axis) {
          if (goes_along(axis)) between(axis, true);
        }
      }
      multiply_waves(i, from, to);
    }
    if (is_along_one_axis()) return;
    for (std::size_t axis = waves_.along; --axis > first_;) {
      if (goes_along(axis)) between(axis, false);
    }
    first_backward(to);
  });
}

}  // namespace dpde
