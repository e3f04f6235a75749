// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace dpde {

struct FourierSolver::Lines {
  Eigen::FFT<double> fft{Eigen::FFT<double>::impl_type(),
                         static_cast<Eigen::FFT<double>::Flag>(Eigen::FFT<double>::Unscaled)};
  std::vector<Complex> from, to;
};

FourierSolver::FourierSolver(FourierSolver&&) noexcept = default;
FourierSolver& FourierSolver::operator=(FourierSolver&&) noexcept = default;
FourierSolver::~FourierSolver() = default;

namespace {

constexpr std::int64_t columns_at_once = 8;

/// The cell and the sign of the image of a place along an axis; the place is at most one length outside.
std::pair<std::int64_t, double> image_of(std::int64_t place, std::int64_t cells, bool is_periodic, double low,
                                         double high) {
  if (is_periodic) return {(place % cells + cells) % cells, 1};
  if (place < 0) return {-1 - place, low};
  if (place >= cells) return {2 * cells - 1 - place, high};
  return {place, 1};
}

bool is_even(const StencilMatrix& matrix, const std::vector<double>& row, std::size_t axis, double zero) {
  for (std::size_t k = 0; k < row.size(); ++k) {
    std::array<int, 3> mirrored = matrix.offsets[k];
    mirrored[axis] = -mirrored[axis];
    const auto other = std::ranges::find(matrix.offsets, mirrored);
    const double value =
        other == matrix.offsets.end() ? 0 : row[static_cast<std::size_t>(other - matrix.offsets.begin())];
    if (std::abs(value - row[k]) > zero) return false;
  }
  return true;
}

}  // namespace

/// Whether each row is the one given, with the columns beyond walls added to those of their images.
bool FourierSolver::is_made_of(const StencilMatrix& matrix, const std::vector<double>& row,
                               const std::array<Images, 3>& images, double rounding) {
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
            if (images[axis].is_periodic) continue;
            const auto [image, s] =
                image_of(cell[axis] + offset[axis], matrix.cells[axis], false, images[axis].low, images[axis].high);
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
  std::array<Images, 3> images;
  int bounded = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    images[axis].is_periodic = matrix.periodic[axis] || matrix.cells[axis] == 1;
    if (images[axis].is_periodic) continue;
    bounded += 2;
    int reach = 0;
    for (const auto& offset : matrix.offsets) reach = std::max(reach, std::abs(offset[axis]));
    if (2 * reach >= matrix.cells[axis] || !is_even(matrix, row, axis, 64 * rounding * size)) return std::nullopt;
  }
  for (int choice = 0; choice < 1 << bounded; ++choice) {
    int bits = choice;
    for (Images& each : images) {
      if (each.is_periodic) continue;
      each.low = (bits & 1) != 0 ? -1 : 1;
      each.high = (bits & 2) != 0 ? -1 : 1;
      bits >>= 2;
    }
    if (is_made_of(matrix, row, images, rounding)) return FourierSolver(matrix, row, images, is_singular);
  }
  return std::nullopt;
}

FourierSolver::FourierSolver(const StencilMatrix& matrix, const std::vector<double>& row,
                             const std::array<Images, 3>& images, bool is_singular)
    : cells_(matrix.cells), length_(matrix.cells), images_(images), lines_(std::make_unique<Lines>()) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!images[axis].is_periodic) length_[axis] *= images[axis].low == images[axis].high ? 2 : 4;
  }
  const auto size = static_cast<std::size_t>(length_[0] * length_[1] * length_[2]);
  waves_.assign(size, 0.0);
  inverse_symbol_.assign(size, 0.0);
  const auto longest = static_cast<std::size_t>(*std::ranges::max_element(length_));
  lines_->from.resize(longest * columns_at_once);
  lines_->to.resize(longest * columns_at_once);
  double zero = 0;  // rows of singular operators are balanced: what is less is of this sum
  for (const double value : row) zero += 64 * 0x1p-52 * std::abs(value);
  std::size_t number = 0;
  for (std::int64_t kz = 0; kz < length_[2]; ++kz) {
    for (std::int64_t ky = 0; ky < length_[1]; ++ky) {
      for (std::int64_t kx = 0; kx < length_[0]; ++kx, ++number) {
        const std::array<std::int64_t, 3> mode{kx, ky, kz};
        Complex symbol = 0;
        for (std::size_t k = 0; k < row.size(); ++k) {
          double angle = 0;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t turns = mode[axis] * matrix.offsets[k][axis] % length_[axis];
            angle += 2 * std::numbers::pi * static_cast<double>(turns) / static_cast<double>(length_[axis]);
          }
          symbol += row[k] * std::polar(1.0, angle);
        }
        const bool is_mean = is_singular && number == 0;
        if (std::abs(symbol) > zero && !is_mean) {
          inverse_symbol_[number] = 1.0 / (symbol * static_cast<double>(size));
        } else if (!is_mean) {
          drops_waves_ = true;
        }
      }
    }
  }
  if (drops_waves_) kept_.assign(size, 0.0);
}

bool FourierSolver::has_walls() const {
  return std::ranges::any_of(images_, [](const Images& images) { return !images.is_periodic; });
}

void FourierSolver::extend(std::span<const double> b) {
  for (std::int64_t z = 0; z < cells_[2]; ++z) {
    for (std::int64_t y = 0; y < cells_[1]; ++y) {
      const double* from = b.data() + cells_[0] * (y + cells_[1] * z);
      std::copy_n(from, cells_[0], waves_.begin() + length_[0] * (y + length_[1] * z));
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) extend_along(axis);
}

/// The image beyond the high side, and where that has another sign than the low one the image of both.
void FourierSolver::extend_along(std::size_t axis) {
  if (images_[axis].is_periodic) return;
  std::array<std::int64_t, 3> stride{1, length_[0], length_[0] * length_[1]}, count = length_;
  for (std::size_t later = axis + 1; later < 3; ++later) count[later] = cells_[later];
  const std::int64_t n = cells_[axis], step = stride[axis];
  count[axis] = 1;
  for (std::int64_t z = 0; z < count[2]; ++z) {
    for (std::int64_t y = 0; y < count[1]; ++y) {
      for (std::int64_t x = 0; x < count[0]; ++x) {
        Complex* line = waves_.data() + x * stride[0] + y * stride[1] + z * stride[2];
        for (std::int64_t i = 0; i < n; ++i) line[(n + i) * step] = images_[axis].high * line[(n - 1 - i) * step];
        if (length_[axis] == 2 * n) continue;
        for (std::int64_t i = 0; i < 2 * n; ++i)
          line[(2 * n + i) * step] = images_[axis].low * line[(2 * n - 1 - i) * step];
      }
    }
  }
}

/// Columns are copied several at once, so that what is read of the grid is read in a row.
void FourierSolver::transform(std::vector<Complex>& values, bool is_forward) {
  std::int64_t step = 1;
  for (const std::int64_t n : length_) {
    const std::int64_t whole = step * n, size = static_cast<std::int64_t>(values.size());
    for (std::int64_t begin = 0; n > 1 && begin < size; begin += whole) {
      for (std::int64_t first = 0; first < step; first += columns_at_once)
        transform_columns(values.data() + begin + first, n, step, std::min(columns_at_once, step - first), is_forward);
    }
    step = whole;
  }
}

void FourierSolver::transform_columns(Complex* values, std::int64_t n, std::int64_t step, std::int64_t columns,
                                      bool is_forward) {
  Complex *from = lines_->from.data(), *to = lines_->to.data();
  for (std::int64_t i = 0; i < n; ++i) {
    for (std::int64_t c = 0; c < columns; ++c) from[c * n + i] = values[i * step + c];
  }
  for (std::int64_t c = 0; c < columns; ++c) {
    if (is_forward) {
      lines_->fft.fwd(to + c * n, from + c * n, n);
    } else {
      lines_->fft.inv(to + c * n, from + c * n, n);
    }
  }
  for (std::int64_t i = 0; i < n; ++i) {
    for (std::int64_t c = 0; c < columns; ++c) values[i * step + c] = to[c * n + i];
  }
}

/// Takes the waves that the operator makes 0 of out of b, too.
double FourierSolver::drop_waves(std::span<double> b) {
  double whole = 0, dropped = 0;
  for (std::size_t i = 0; i < waves_.size(); ++i) {
    const bool is_dropped = inverse_symbol_[i] == Complex(0);
    const double size = std::norm(waves_[i]);
    whole += size;
    dropped += is_dropped ? size : 0;
    kept_[i] = is_dropped ? 0 : waves_[i] / static_cast<double>(waves_.size());
  }
  transform(kept_, false);
  take(kept_, b);
  return whole == 0 ? 0 : std::sqrt(dropped / whole);
}

void FourierSolver::take(const std::vector<Complex>& waves, std::span<double> values) const {
  for (std::int64_t z = 0; z < cells_[2]; ++z) {
    for (std::int64_t y = 0; y < cells_[1]; ++y) {
      const Complex* from = waves.data() + length_[0] * (y + length_[1] * z);
      double* to = values.data() + cells_[0] * (y + cells_[1] * z);
      for (std::int64_t i = 0; i < cells_[0]; ++i) to[i] = from[i].real();
    }
  }
}

double FourierSolver::solve(std::span<double> b, std::span<double> x) {
  extend(b);
  transform(waves_, true);
  const double dropped = drops_waves_ ? drop_waves(b) : 0;
  for (std::size_t i = 0; i < waves_.size(); ++i) waves_[i] *= inverse_symbol_[i];
  transform(waves_, false);
  take(waves_, x);
  return dropped;
}

}  // namespace dpde
