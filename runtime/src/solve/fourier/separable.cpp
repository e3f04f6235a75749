// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier/separable.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

constexpr std::int64_t modes_of_block = 32;

bool vanishes(double value) { return value == 0; }

/// Magnitudes of the rows, and whether rows are constant along an axis.
class Rows {
 public:
  explicit Rows(const StencilMatrix& matrix) : matrix_(matrix), sizes_(static_cast<std::size_t>(matrix.size()), 0.0) {
    for (const std::vector<double>& entries : matrix.values) {
      for (std::size_t i = 0; i < sizes_.size(); ++i) sizes_[i] += std::abs(entries[i]);
    }
  }

  bool are_same_along(std::size_t axis) const {
    std::int64_t step = 1;
    for (std::size_t before = 0; before < axis; ++before) step *= matrix_.cells[before];
    return std::ranges::all_of(matrix_.values, [&](const std::vector<double>& entries) {
      for (std::size_t i = 0; i < entries.size(); ++i) {
        const std::int64_t number = static_cast<std::int64_t>(i) / step % matrix_.cells[axis];
        const std::size_t first = i - static_cast<std::size_t>(number * step);
        if (!(std::abs(entries[i] - entries[first]) <= difference_of_same_rows * sizes_[i])) return false;
      }
      return true;
    });
  }
  bool couple_neighbours_along(std::size_t axis) const {
    for (std::size_t k = 0; k < matrix_.offsets.size(); ++k) {
      if (std::abs(matrix_.offsets[k][axis]) > 1 && !std::ranges::all_of(matrix_.values[k], vanishes)) return false;
    }
    return true;
  }

 private:
  const StencilMatrix& matrix_;
  std::vector<double> sizes_;
};

/// Empty if no axis, or more than one, remains for the lines.
std::optional<SeparableSolver::Axes> axes_of(const StencilMatrix& matrix) {
  const Rows rows(matrix);
  std::vector<std::size_t> waves, lines;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (matrix.cells[axis] == 1) continue;
    (matrix.periodic[axis] && rows.are_same_along(axis) ? waves : lines).push_back(axis);
  }
  if (waves.empty() || lines.size() != 1 || matrix.periodic[lines.front()]) return std::nullopt;
  if (!rows.couple_neighbours_along(lines.front())) return std::nullopt;
  if (waves.size() == 1) return SeparableSolver::Axes{waves.front(), lines.front(), std::nullopt};
  // Lines of the first axis must have a constant distance: it is the innermost or the outermost axis.
  if (waves.front() == 0) return SeparableSolver::Axes{0, lines.front(), waves.back()};
  return SeparableSolver::Axes{waves.back(), lines.front(), waves.front()};
}

/// e^(2*pi*i*j/n)
std::vector<std::complex<double>> turns_of(std::int64_t n) {
  std::vector<std::complex<double>> turns;
  for (std::int64_t j = 0; j < n; ++j)
    turns.push_back(std::polar(1.0, 2 * std::numbers::pi * static_cast<double>(j) / static_cast<double>(n)));
  return turns;
}

/// The rows at one position along the lines: multipliers of a mode, for the previous cell, the cell and the next one.
class Symbols {
 public:
  Symbols(const StencilMatrix& matrix, const SeparableSolver::Axes& axes)
      : matrix_(matrix), axes_(axes), first_turns_(turns_of(matrix.cells[axes.first])) {
    if (axes.second) second_turns_ = turns_of(matrix.cells[*axes.second]);
    for (std::size_t before = 0; before < axes.along; ++before) step_ *= matrix.cells[before];
  }

  struct Row {
    std::array<double, 3> entries{};
    bool is_even = true;  // a mode and its mirror image have the same multipliers
  };
  Row at(std::int64_t place, std::int64_t first, std::int64_t second) const {
    std::array<std::complex<double>, 3> sums{};
    double size = 0;
    for (std::size_t k = 0; k < matrix_.offsets.size(); ++k) {
      const double entry = matrix_.values[k][static_cast<std::size_t>(place * step_)];
      if (entry == 0) continue;
      const std::array<int, 3>& offset = matrix_.offsets[k];
      std::complex<double> turn = turn_of(first_turns_, first * offset[axes_.first]);
      if (axes_.second) turn *= turn_of(second_turns_, second * offset[*axes_.second]);
      sums[static_cast<std::size_t>(offset[axes_.along] + 1)] += entry * turn;
      size += std::abs(entry);
    }
    Row row;
    for (std::size_t d = 0; d < 3; ++d) {
      row.entries[d] = sums[d].real();
      row.is_even = row.is_even && std::abs(sums[d].imag()) <= 64 * 0x1p-52 * size;
    }
    return row;
  }

 private:
  static std::complex<double> turn_of(const std::vector<std::complex<double>>& turns, std::int64_t number) {
    const auto n = static_cast<std::int64_t>(turns.size());
    return turns[static_cast<std::size_t>((number % n + n) % n)];
  }

  const StencilMatrix& matrix_;
  SeparableSolver::Axes axes_;
  std::vector<std::complex<double>> first_turns_, second_turns_;
  std::int64_t step_ = 1;
};

}  // namespace

std::optional<SeparableSolver> SeparableSolver::of(const StencilMatrix& matrix, const NullSpace& null_space,
                                                   const Team& team) {
  const bool is_singular = !null_space.is_empty();
  const auto size = static_cast<std::size_t>(matrix.size());
  if (is_singular && (null_space.is_lopsided() || null_space.parts().front().size() != size)) return std::nullopt;
  const std::optional<Axes> axes = axes_of(matrix);
  if (!axes) return std::nullopt;
  SeparableSolver solver(*axes, matrix.cells, is_singular, team);
  if (!solver.factor(matrix, *axes)) return std::nullopt;
  return solver;
}

SeparableSolver::SeparableSolver(const Axes& axes, const std::array<std::int64_t, 3>& cells, bool is_singular,
                                 const Team& team)
    : firsts_(lines_along(axes.first, cells), team), is_singular_(is_singular) {
  shape_.modes = firsts_.lines().length / 2 + 1;
  std::int64_t rows = 1;  // stride of an axis in rows, counting only axes not transformed first
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis == axes.first) continue;
    if (axis == axes.along) shape_.length = cells[axis], shape_.length_step = rows;
    if (axis == axes.second) shape_.second = cells[axis], shape_.second_step = rows;
    rows *= cells[axis];
  }
  waves_.resize(static_cast<std::size_t>(firsts_.lines().lines * shape_.modes));
  for (int i = 0; axes.second && i < firsts_.team().threads(); ++i)
    seconds_.emplace_back(lines_in_place(shape_.second, shape_.modes, shape_.second_step * shape_.modes, 1));
}

/// The pivots also contain the factor of forward and backward transforms.
bool SeparableSolver::factor(const StencilMatrix& matrix, const Axes& axes) {
  constexpr double dominance = 0.999999;  // as in TridiagonalSolver
  const Symbols symbols(matrix, axes);
  const double scale = 1 / static_cast<double>(firsts_.lines().length * shape_.second);
  for (auto* values : {&factors_.lower, &factors_.pivot, &factors_.upper}) values->assign(waves_.size(), 0.0);
  for (std::int64_t second = 0; second < shape_.second; ++second) {
    for (std::int64_t mode = 0; mode < shape_.modes; ++mode) {
      const bool is_mean = is_singular_ && mode == 0 && second == 0;
      double pivot = 0, upper = 0;  // of the previous position
      for (std::int64_t i = 0; i < shape_.length; ++i) {
        const Symbols::Row row = symbols.at(i, mode, second);
        auto [lower, diagonal, next] = row.entries;
        if (!row.is_even || diagonal == 0 || std::abs(diagonal) < dominance * (std::abs(lower) + std::abs(next)))
          return false;
        if (is_mean && i == 0) next = 0;  // the first cell is fixed to 0, so the next row does not use it
        if (i == 0 || (is_mean && i == 1)) lower = 0;
        const double left = diagonal - lower * pivot * upper;
        if (std::abs(left) <= 1e-13 * std::abs(diagonal)) return false;
        const auto at = static_cast<std::size_t>(row_of(second, i) + mode);
        factors_.lower[at] = lower * pivot;
        pivot = 1 / left, upper = i + 1 < shape_.length ? next : 0;
        factors_.pivot[at] = pivot * scale;
        factors_.upper[at] = upper * pivot;
      }
    }
  }
  return true;
}

void SeparableSolver::transform_second(bool back) {
  if (seconds_.empty()) return;
  firsts_.team().run(shape_.length, [&](std::int64_t i, int thread) {
    ComplexFft& transform = seconds_[static_cast<std::size_t>(thread)];
    Complex* const waves = waves_.data() + row_of(0, i);
    back ? transform.backward(waves) : transform.forward(waves);
  });
}

/// Subtracts the mean from the constant mode.
void SeparableSolver::take_mean_away() {
  Complex sum = 0;
  for (std::int64_t i = 0; i < shape_.length; ++i) sum += waves_[static_cast<std::size_t>(row_of(0, i))];
  const Complex mean = sum / static_cast<double>(shape_.length);
  for (std::int64_t i = 0; i < shape_.length; ++i) waves_[static_cast<std::size_t>(row_of(0, i))] -= mean;
}

/// Eliminates modes `begin` to `end` along the first axis, all of them together, position by position.
void SeparableSolver::eliminate(std::int64_t second, std::int64_t begin, std::int64_t end) {
  for (std::int64_t i = 1; i < shape_.length; ++i) {
    const std::int64_t here = row_of(second, i), before = row_of(second, i - 1);
    for (std::int64_t mode = begin; mode < end; ++mode)
      waves_[static_cast<std::size_t>(here + mode)] -=
          factors_.lower[static_cast<std::size_t>(here + mode)] * waves_[static_cast<std::size_t>(before + mode)];
  }
  for (std::int64_t i = shape_.length; i-- > 0;) {
    const std::int64_t here = row_of(second, i), next = row_of(second, std::min(i + 1, shape_.length - 1));
    for (std::int64_t mode = begin; mode < end; ++mode) {
      const auto at = static_cast<std::size_t>(here + mode);
      waves_[at] = factors_.pivot[at] * waves_[at] - factors_.upper[at] * waves_[static_cast<std::size_t>(next + mode)];
    }
  }
}

void SeparableSolver::divide(std::span<const double> b, std::span<double> x) {
  const std::int64_t apart = firsts_.lines().apart;
  firsts_.for_each([&](RealFft& transform, std::int64_t first, std::int64_t, int) {
    transform.forward(b.data() + first * apart, waves_.data() + first * shape_.modes);
  });
  transform_second(false);
  if (is_singular_) {
    take_mean_away();
    waves_[0] = 0;  // the fixed cell
  }
  const std::int64_t blocks = (shape_.modes + modes_of_block - 1) / modes_of_block;
  firsts_.team().run(shape_.second * blocks, [&](std::int64_t number, int) {
    const std::int64_t begin = number % blocks * modes_of_block;
    eliminate(number / blocks, begin, std::min(begin + modes_of_block, shape_.modes));
  });
  if (is_singular_) take_mean_away();
  transform_second(true);
  firsts_.for_each([&](RealFft& transform, std::int64_t first, std::int64_t, int) {
    transform.backward(waves_.data() + first * shape_.modes, x.data() + first * apart);
  });
}

}  // namespace dpde
