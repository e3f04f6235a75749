// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

namespace dpde {
namespace {

using Complex = std::complex<double>;

double sign_of_low(Sides sides) { return sides == Sides::odd_odd || sides == Sides::odd_even ? -1 : 1; }
double sign_of_high(Sides sides) { return sides == Sides::odd_odd || sides == Sides::even_odd ? -1 : 1; }

/// The cell and the sign of the image of a place along a bounded axis; the place is at most one length outside.
std::pair<std::int64_t, double> image_of(std::int64_t place, std::int64_t cells, Sides sides) {
  if (place < 0) return {-1 - place, sign_of_low(sides)};
  if (place >= cells) return {2 * cells - 1 - place, sign_of_high(sides)};
  return {place, 1};
}

/// Whether mirrored offsets have the same entries; `mirrored`: the axes.
bool is_even(const StencilMatrix& matrix, const std::vector<double>& row, const std::array<bool, 3>& mirrored,
             double zero) {
  for (std::size_t k = 0; k < row.size(); ++k) {
    std::array<int, 3> image = matrix.offsets[k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (mirrored[axis]) image[axis] = -image[axis];
    }
    const auto other = std::ranges::find(matrix.offsets, image);
    const double value =
        other == matrix.offsets.end() ? 0 : row[static_cast<std::size_t>(other - matrix.offsets.begin())];
    if (std::abs(value - row[k]) > zero) return false;
  }
  return true;
}

/// Whether each row is the one given, with the columns beyond walls added to those of their images.
bool is_made_of(const StencilMatrix& matrix, const std::vector<double>& row, const std::array<Sides, 3>& sides,
                double rounding) {
  double size = 0;
  for (const double value : row) size += std::abs(value);
  const double zero = 64 * rounding * size;
  std::vector<double> expected(row.size());
  std::size_t number = 0;
  for (std::int64_t z = 0; z < matrix.cells[2]; ++z) {
    for (std::int64_t y = 0; y < matrix.cells[1]; ++y) {
      for (std::int64_t x = 0; x < matrix.cells[0]; ++x, ++number) {
        const std::array<std::int64_t, 3> cell{x, y, z};
        std::ranges::fill(expected, 0.0);
        for (std::size_t k = 0; k < row.size(); ++k) {
          std::array<int, 3> offset = matrix.offsets[k];
          double sign = 1;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            if (sides[axis] == Sides::periodic) continue;
            const auto [image, s] = image_of(cell[axis] + offset[axis], matrix.cells[axis], sides[axis]);
            offset[axis] = static_cast<int>(image - cell[axis]);
            sign *= s;
          }
          const auto known = std::ranges::find(matrix.offsets, offset);
          if (known == matrix.offsets.end()) {
            if (std::abs(row[k]) > zero) return false;
            continue;
          }
          expected[static_cast<std::size_t>(known - matrix.offsets.begin())] += sign * row[k];
        }
        for (std::size_t k = 0; k < row.size(); ++k) {
          if (!(std::abs(expected[k] - matrix.values[k][number]) <= zero)) return false;
        }
      }
    }
  }
  return true;
}

}  // namespace

std::optional<FourierSolver> FourierSolver::of(const StencilMatrix& matrix, double rounding, bool is_singular) {
  if (matrix.offsets.empty()) return std::nullopt;
  const std::int64_t middle =
      matrix.cells[0] / 2 + matrix.cells[0] * (matrix.cells[1] / 2 + matrix.cells[1] * (matrix.cells[2] / 2));
  std::vector<double> row;
  double size = 0;
  for (const std::vector<double>& column : matrix.values) {
    row.push_back(column[static_cast<std::size_t>(middle)]);
    size += std::abs(row.back());
  }
  std::array<Sides, 3> sides{};
  int bounded = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (matrix.periodic[axis] || matrix.cells[axis] == 1) continue;
    sides[axis] = Sides::even_even;
    bounded += 2;
    std::array<bool, 3> mirrored{};
    mirrored[axis] = true;
    int reach = 0;
    for (const auto& offset : matrix.offsets) reach = std::max(reach, std::abs(offset[axis]));
    if (2 * reach >= matrix.cells[axis] || !is_even(matrix, row, mirrored, 64 * rounding * size)) return std::nullopt;
  }
  for (int choice = 0; choice < 1 << bounded; ++choice) {
    int bits = choice;
    for (Sides& each : sides) {
      if (each == Sides::periodic) continue;
      each = std::array{Sides::even_even, Sides::odd_even, Sides::even_odd, Sides::odd_odd}[bits & 3];
      bits >>= 2;
    }
    if (is_made_of(matrix, row, sides, rounding)) return FourierSolver(matrix, row, sides, is_singular);
  }
  return std::nullopt;
}

FourierSolver::FourierSolver(const StencilMatrix& matrix, const std::vector<double>& row,
                             const std::array<Sides, 3>& sides, bool is_singular)
    : sides_(sides), waves_(matrix.cells, sides) {
  double size = 0;
  for (const double value : row) size += std::abs(value);
  const double zero = 64 * 0x1p-52 * size;  // rows of singular operators are balanced: what is less is of this sum
  std::array<bool, 3> rings{};
  for (std::size_t axis = 0; axis < 3; ++axis) rings[axis] = sides[axis] == Sides::periodic;
  have_phases_ = waves_.are_complex() && !is_even(matrix, row, rings, 4 * 0x1p-52 * size);
  inverse_symbol_.assign(static_cast<std::size_t>(waves_.size() * (have_phases_ ? 2 : 1)), 0.0);
  std::vector<double> dropped(inverse_symbol_.size(), 0.0);
  bool drops_some = false;
  const auto set = [&](std::vector<double>& factors, std::size_t number, Complex value) {
    factors[have_phases_ ? 2 * number : number] = value.real();
    if (have_phases_) factors[2 * number + 1] = value.imag();
  };
  waves_.for_each([&](std::size_t number, const std::array<std::int64_t, 3>& turns) {
    Complex symbol = 0;
    for (std::size_t k = 0; k < row.size(); ++k) {
      double angle = 0, cosines = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t period = waves_.period(axis), steps = turns[axis] * matrix.offsets[k][axis] % period;
        const double turn = 2 * std::numbers::pi * static_cast<double>(steps) / static_cast<double>(period);
        if (sides[axis] == Sides::periodic) {
          angle += turn;
        } else {
          cosines *= std::cos(turn);
        }
      }
      symbol += row[k] * cosines * std::polar(1.0, angle);
    }
    if (!have_phases_) symbol = symbol.real();
    const bool is_mean = is_singular && turns == std::array<std::int64_t, 3>{};
    if (std::abs(symbol) > zero && !is_mean) {
      set(inverse_symbol_, number, 1.0 / (symbol * waves_.scale()));
    } else if (!is_mean) {
      set(dropped, number, 1 / waves_.scale());
      drops_some = true;
    }
  });
  if (!drops_some) return;
  dropped_ = std::move(dropped);
  taken_.assign(static_cast<std::size_t>(matrix.size()), 0.0);
}

bool FourierSolver::has_walls() const {
  return std::ranges::any_of(sides_, [](Sides sides) { return sides != Sides::periodic; });
}

/// Takes the waves that the operator makes 0 of out of b.
double FourierSolver::drop_waves(std::span<double> b) {
  waves_.multiply(b, dropped_.data(), have_phases_, taken_);
  double whole = 0, dropped = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    whole += b[i] * b[i];
    dropped += taken_[i] * taken_[i];
    b[i] -= taken_[i];
  }
  return whole == 0 ? 0 : std::sqrt(dropped / whole);
}

double FourierSolver::solve(std::span<double> b, std::span<double> x) {
  const double dropped = dropped_.empty() ? 0 : drop_waves(b);
  waves_.multiply(b, inverse_symbol_.data(), have_phases_, x);
  return dropped;
}

}  // namespace dpde
