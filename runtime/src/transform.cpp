// SPDX-License-Identifier: Apache-2.0
#include "transform.h"

#include <algorithm>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <utility>

#include "dpde/runtime/layout.h"
#include "dpde/wave_functions.h"
#include "fft.h"
#include "real.h"

namespace dpde {
namespace {

constexpr int64_t least_cells_of_team = 16 * 1024, lines_at_once = 8;

int64_t signed_mode(int64_t m, int64_t n) { return 2 * m <= n ? m : m - n; }

std::array<int64_t, 3> dense_strides(const std::array<int64_t, 3>& lengths) {
  return {1, lengths[0], lengths[0] * lengths[1]};
}

}  // namespace

struct FieldTransform::Lines {
  std::vector<double> real;
  std::optional<RealFft> first;                          // between `real` and a line of the array of waves
  std::array<std::optional<ComplexFft>, 3> block, last;  // of lines side by side, in place

  explicit Lines(const FieldTransform& of) : real(static_cast<std::size_t>(of.cells_[of.first_])) {
    const std::array<int64_t, 3> strides = dense_strides(of.modes_);
    const int64_t n = of.cells_[of.first_], width = of.modes_[0];
    if (of.goes_along(of.first_)) first.emplace(RealLines{n, 1, 1, n, strides[of.first_], 1});
    for (std::size_t axis = of.first_ + 1; axis < 3; ++axis) {
      if (!of.goes_along(axis)) continue;
      if (width >= lines_at_once) block[axis].emplace(of.modes_[axis], lines_at_once, strides[axis], 1);
      if (width % lines_at_once != 0) last[axis].emplace(of.modes_[axis], width % lines_at_once, strides[axis], 1);
    }
  }
};

FieldTransform::FieldTransform() = default;
FieldTransform::~FieldTransform() = default;
FieldTransform::FieldTransform(FieldTransform&&) noexcept = default;
FieldTransform& FieldTransform::operator=(FieldTransform&&) noexcept = default;

FieldTransform::FieldTransform(const dpde_transform& transform, const dpde_layout& layout, const Team& team)
    : transform_(transform), real_(layout.real) {
  for (std::size_t axis = 3; axis-- > 0;) {
    if (static_cast<int32_t>(axis) >= layout.rank) continue;
    cells_[axis] = layout.cells[axis];
    stride_[axis] = layout.stride[axis];
    if (transform.axes[axis] != 0) first_ = axis;
  }
  modes_ = cells_;
  if (transform.axes[first_] != 0) modes_[first_] = cells_[first_] / 2 + 1;
  if (cells_[0] * cells_[1] * cells_[2] >= least_cells_of_team) team_ = team;
  for (int32_t i = 0; i < transform.term_count; ++i) {
    const dpde_transform_term& term = transform.terms[i];
    auto known = std::ranges::find(operands_, term.field, &Operand::field);
    if (known == operands_.end()) known = operands_.insert(operands_.end(), Operand{term.field, {}, {}});
    known->terms.push_back(&term);
    note_uniforms(term.argument);
    note_uniforms(term.factor);
  }
  values_.assign(uniforms_.size(), 0.0);
  const auto size = static_cast<std::size_t>(modes());
  for (Operand& operand : operands_) operand.multipliers.assign(size, 0.0);
  waves_.assign(size, 0.0);
  sum_.assign(size, 0.0);
  for (int i = 0; i < team_.threads(); ++i) lines_.emplace_back(*this);
}

void FieldTransform::note_uniforms(const dpde_symbol& symbol) {
  for (int32_t i = 0; i < symbol.count; ++i) {
    const int32_t uniform = symbol.monomials[i].uniform;
    if (uniform >= 0 && !std::ranges::count(uniforms_, uniform)) uniforms_.push_back(uniform);
  }
}

/// The first time too.
bool FieldTransform::has_changed(const double* uniforms) {
  bool changed = !std::exchange(is_made_, true);
  for (std::size_t i = 0; i < uniforms_.size(); ++i) {
    const double value = uniforms[uniforms_[i]];
    changed = changed || values_[i] != value;
    values_[i] = value;
  }
  return changed;
}

FieldTransform::Symbol FieldTransform::value(const dpde_symbol& symbol, const std::array<double, 3>& angles,
                                             const double* uniforms) const {
  Symbol result;
  for (int32_t i = 0; i < symbol.count; ++i) {
    const dpde_monomial& monomial = symbol.monomials[i];
    Complex term = monomial.uniform == DPDE_ZERO ? 0 : monomial.uniform == DPDE_ONE ? 1 : uniforms[monomial.uniform];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (int32_t k = 0; k < monomial.powers[axis]; ++k) term *= Complex(0, angles[axis]);
    }
    result.sum += term;
    result.size += std::abs(term);
  }
  return result;
}

/// Over both signs of the angles of waves of two cells, along `axis` and those behind it.
FieldTransform::Complex FieldTransform::mean_at(const Operand& operand, std::array<double, 3> angles, std::size_t axis,
                                                bool is_short, const double* uniforms) const {
  for (; axis < 3; ++axis) {
    if (angles[axis] != std::numbers::pi) continue;
    const Complex positive = mean_at(operand, angles, axis + 1, is_short, uniforms);
    angles[axis] = -angles[axis];
    return (positive + mean_at(operand, angles, axis + 1, is_short, uniforms)) / 2.0;
  }
  Complex sum = 0;
  for (const dpde_transform_term* term : operand.terms) {
    if (is_short && term->within_two_thirds != 0) continue;
    const Complex factor = value(term->factor, angles, uniforms).sum;
    if (term->function == DPDE_NO_FUNCTION) {
      sum += factor;
      continue;
    }
    const Symbol argument = value(term->argument, angles, uniforms);
    const bool is_phi = term->function == DPDE_PHI;
    sum += factor * (is_phi ? phi(term->number, argument.sum) : inverse(term->number, argument.sum, argument.size));
  }
  return sum;
}

FieldTransform::Complex FieldTransform::multiplier_at(const Operand& operand, const std::array<int64_t, 3>& mode,
                                                      const double* uniforms) const {
  bool is_short = false;
  std::array<double, 3> angles{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (transform_.axes[axis] == 0) continue;
    const int64_t n = cells_[axis], m = signed_mode(mode[axis], n);
    is_short = is_short || (m != 0 && 3 * std::abs(m) >= n);
    angles[axis] =
        2 * m == n ? std::numbers::pi : 2 * std::numbers::pi * static_cast<double>(m) / static_cast<double>(n);
  }
  return mean_at(operand, angles, 0, is_short, uniforms);
}

void FieldTransform::make_multipliers(const double* uniforms) {
  if (!has_changed(uniforms)) return;
  double cells = 1;  // transforms there and back multiply by their number
  for (std::size_t axis = 0; axis < 3; ++axis)
    cells *= transform_.axes[axis] != 0 ? static_cast<double>(cells_[axis]) : 1;
  for (Operand& operand : operands_) {
    team_.run(modes_[1] * modes_[2], [&](int64_t row, int) {
      Complex* const to = operand.multipliers.data() + row * modes_[0];
      for (int64_t i = 0; i < modes_[0]; ++i)
        to[i] = multiplier_at(operand, {i, row % modes_[1], row / modes_[1]}, uniforms) / cells;
    });
  }
}

/// Of an array with these lengths and strides.
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

template <class Real>
void FieldTransform::forward(const Real* from) {
  const std::array<int64_t, 3> strides = dense_strides(modes_);
  const LineBegins source(cells_, stride_, first_), target(modes_, strides, first_);
  const int64_t n = cells_[first_];
  team_.run(source.count(), [&](int64_t line, int thread) {
    Lines& own = lines_[static_cast<std::size_t>(thread)];
    const Real* const begin = from + source.begin(line);
    Complex* const to = waves_.data() + target.begin(line);
    for (int64_t i = 0; i < n; ++i) own.real[static_cast<std::size_t>(i)] = begin[i * stride_[first_]];
    if (!goes_along(first_)) {
      for (int64_t i = 0; i < n; ++i) to[i * strides[first_]] = own.real[static_cast<std::size_t>(i)];
      return;
    }
    own.first->forward(own.real.data(), to);
  });
  along_others(waves_, true);
}

template <class Real>
void FieldTransform::backward(Real* to) {
  along_others(sum_, false);
  const std::array<int64_t, 3> strides = dense_strides(modes_);
  const LineBegins source(modes_, strides, first_), target(cells_, stride_, first_);
  const int64_t n = cells_[first_];
  team_.run(source.count(), [&](int64_t line, int thread) {
    Lines& own = lines_[static_cast<std::size_t>(thread)];
    Complex* const begin = sum_.data() + source.begin(line);
    Real* const end = to + target.begin(line);
    if (!goes_along(first_)) {
      for (int64_t i = 0; i < n; ++i) end[i * stride_[first_]] = static_cast<Real>(begin[i * strides[first_]].real());
      return;
    }
    own.first->backward(begin, own.real.data());
    for (int64_t i = 0; i < n; ++i) end[i * stride_[first_]] = static_cast<Real>(own.real[static_cast<std::size_t>(i)]);
  });
}

void FieldTransform::along_others(std::vector<Complex>& waves, bool is_forward) {
  for (std::size_t axis = first_ + 1; axis < 3; ++axis) {
    if (goes_along(axis)) along(waves, axis, is_forward);
  }
}

/// The lines of a block are side by side along the first axis of the array.
void FieldTransform::along(std::vector<Complex>& waves, std::size_t axis, bool is_forward) {
  const LineBegins lines(modes_, dense_strides(modes_), axis);
  const int64_t blocks = (lines.counts[0] + lines_at_once - 1) / lines_at_once;
  team_.run(blocks * lines.counts[1], [&](int64_t block, int thread) {
    Lines& own = lines_[static_cast<std::size_t>(thread)];
    const int64_t line = block % blocks * lines_at_once;
    Complex* const begin = waves.data() + line + block / blocks * lines.strides[1];
    ComplexFft& fft = lines.counts[0] - line < lines_at_once ? *own.last[axis] : *own.block[axis];
    if (is_forward) {
      fft.forward(begin);
    } else {
      fft.backward(begin);
    }
  });
}

void FieldTransform::run(void* const* fields, const double* uniforms) {
  make_multipliers(uniforms);
  with_real(real_, [&](auto real) {
    using Real = decltype(real);
    bool is_first = true;
    for (const Operand& operand : operands_) {
      forward(static_cast<const Real*>(fields[operand.field]));
      const Complex* const multipliers = operand.multipliers.data();
      team_.run(modes_[1] * modes_[2], [&](int64_t row, int) {
        for (int64_t i = row * modes_[0]; i < (row + 1) * modes_[0]; ++i) {
          const Complex value = multipliers[i] * waves_[static_cast<std::size_t>(i)];
          sum_[static_cast<std::size_t>(i)] = is_first ? value : sum_[static_cast<std::size_t>(i)] + value;
        }
      });
      is_first = false;
    }
    backward(static_cast<Real*>(fields[transform_.result]));
  });
}

}  // namespace dpde
