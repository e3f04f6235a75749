// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier/line_series.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace dpde {
namespace {

using Complex = std::complex<double>;

/// Whether lines along the axis are coupled and have a constant distance.
bool are_lines(std::size_t axis, const std::array<std::int64_t, 3>& cells) {
  std::int64_t before = 1, behind = 1;
  for (std::size_t other = 0; other < 3; ++other) {
    if (other != axis) (other < axis ? before : behind) *= cells[other];
  }
  return cells[axis] > 1 && (before == 1 || behind == 1);
}

bool couples_along(const StencilMatrix& matrix, std::size_t axis) {
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    std::array<int, 3> across = matrix.offsets[k];
    across[axis] = 0;
    if (across != std::array<int, 3>{} && std::ranges::any_of(matrix.values[k], [](double v) { return v != 0; }))
      return false;
  }
  return true;
}

/// A line of the matrix: entries of its first row and their offsets along the line.
class Line {
 public:
  Line(const StencilMatrix& matrix, std::size_t axis, std::int64_t first, std::int64_t step)
      : matrix_(matrix), axis_(axis), first_(first), step_(step), n_(matrix.cells[axis]) {
    for (const std::vector<double>& entries : matrix.values) size_ += std::abs(entries[at(0)]);
  }

  bool is_even_along() const {
    const double zero = difference_of_same_rows * size_;
    for (const std::vector<double>& entries : matrix_.values) {
      for (std::int64_t i = 1; i < n_; ++i) {
        if (!(std::abs(entries[at(i)] - entries[at(0)]) <= zero)) return false;
      }
    }
    return true;
  }
  Complex symbol(std::int64_t mode) const {
    Complex sum = 0;
    for (std::size_t k = 0; k < matrix_.offsets.size(); ++k) {
      const std::int64_t steps = mode * matrix_.offsets[k][axis_] % n_;
      sum += matrix_.values[k][at(0)] *
             std::polar(1.0, 2 * std::numbers::pi * static_cast<double>(steps) / static_cast<double>(n_));
    }
    return std::abs(sum) > 64 * 0x1p-52 * size_ ? sum : 0;
  }

 private:
  std::size_t at(std::int64_t i) const { return static_cast<std::size_t>(first_ + i * step_); }

  const StencilMatrix& matrix_;
  std::size_t axis_;
  std::int64_t first_, step_, n_;
  double size_ = 0;
};

std::vector<Complex> factors_of(const StencilMatrix& matrix, std::size_t axis, const RealLines& lines) {
  std::vector<Complex> factors(static_cast<std::size_t>(lines.lines * (lines.length / 2 + 1)));
  for (std::int64_t number = 0; number < lines.lines; ++number) {
    const Line line(matrix, axis, number * lines.apart, lines.step);
    if (!line.is_even_along()) return {};
    for (std::int64_t mode = 0; mode <= lines.length / 2; ++mode) {
      const Complex symbol = line.symbol(mode);
      if (symbol == 0.0) return {};
      factors[static_cast<std::size_t>(number * lines.wave_apart + mode * lines.wave_step)] =
          1.0 / (symbol * static_cast<double>(lines.length));
    }
  }
  return factors;
}

}  // namespace

std::optional<LineSeries> LineSeries::of(const StencilMatrix& matrix, const Team& team) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!matrix.periodic[axis] || !are_lines(axis, matrix.cells) || !couples_along(matrix, axis)) continue;
    const RealLines lines = lines_along(axis, matrix.cells);
    std::vector<Complex> factors = factors_of(matrix, axis, lines);
    if (!factors.empty()) return LineSeries(lines, std::move(factors), team);
  }
  return std::nullopt;
}

LineSeries::LineSeries(const RealLines& lines, std::vector<Complex> factors, const Team& team)
    : blocks_(lines, team), factors_(std::move(factors)) {
  waves_.resize(static_cast<std::size_t>(blocks_.team().threads()),
                std::vector<Complex>(static_cast<std::size_t>(blocks_.block() * lines.wave_apart)));
}

void LineSeries::divide(std::span<const double> b, std::span<double> x) {
  const RealLines& lines = blocks_.lines();
  blocks_.for_each([&](RealFft& transform, std::int64_t first, std::int64_t count, int thread) {
    std::vector<Complex>& waves = waves_[static_cast<std::size_t>(thread)];
    transform.forward(b.data() + first * lines.apart, waves.data());
    const Complex* const factors = factors_.data() + first * lines.wave_apart;
    for (std::int64_t i = 0; i < count * lines.wave_apart; ++i) waves[static_cast<std::size_t>(i)] *= factors[i];
    transform.backward(waves.data(), x.data() + first * lines.apart);
  });
}

}  // namespace dpde
