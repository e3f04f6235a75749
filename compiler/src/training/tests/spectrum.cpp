// SPDX-License-Identifier: Apache-2.0
#include "training/tests/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace dpde::training {

namespace {

using Complex = std::complex<double>;

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// Mode of index i: cells beyond the half are negative modes.
double mode(std::size_t i, std::size_t cells) {
  return i <= cells / 2 ? static_cast<double>(i) : static_cast<double>(i) - static_cast<double>(cells);
}

}  // namespace

struct Spectrum::Impl {
  std::array<std::size_t, 3> cells{1, 1, 1};
  std::array<double, 3> waves{0, 0, 0};  // wave number of one mode along each axis, in units
  double unit = 2 * std::numbers::pi;
  std::vector<std::size_t> shells;  // for each mode
  std::size_t count = 1, last_resolved = 0;
  Eigen::FFT<double> fft;
  std::vector<Complex> modes;

  /// Fourier transform along one axis, line by line.
  void transform(std::size_t axis) {
    const std::size_t n = cells[axis];
    if (n == 1) return;
    const std::size_t stride = axis == 0 ? 1 : axis == 1 ? cells[0] : cells[0] * cells[1];
    std::vector<Complex> line(n), transformed(n);
    for (std::size_t first = 0; first < modes.size(); ++first) {
      if (first / stride % n != 0) continue;
      for (std::size_t i = 0; i < n; ++i) line[i] = modes[first + i * stride];
      fft.fwd(transformed.data(), line.data(), static_cast<Eigen::Index>(n));
      for (std::size_t i = 0; i < n; ++i) modes[first + i * stride] = transformed[i];
    }
  }
};

Spectrum::~Spectrum() = default;
Spectrum::Spectrum(Spectrum&&) noexcept = default;

Spectrum::Spectrum(const std::vector<model::Axis>& axes) : impl_(std::make_unique<Impl>()) {
  double longest = 0;
  for (const model::Axis& axis : axes) longest = std::max(longest, axis.cells > 1 ? axis.high - axis.low : 0);
  double resolved = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < axes.size(); ++a) {
    impl_->cells[a] = static_cast<std::size_t>(axes[a].cells);
    if (axes[a].cells == 1) continue;
    impl_->waves[a] = longest / (axes[a].high - axes[a].low);
    resolved = std::min(resolved, axes[a].cells / 2.0 * impl_->waves[a] - 0.5);
  }
  impl_->unit = model::wave_unit(axes);
  constexpr double rounding = 1e-9;
  if (std::isfinite(resolved))
    impl_->last_resolved = static_cast<std::size_t>(std::max(0.0, std::floor(resolved + rounding)));
  const auto& [nx, ny, nz] = impl_->cells;
  for (std::size_t z = 0; z < nz; ++z) {
    for (std::size_t y = 0; y < ny; ++y) {
      for (std::size_t x = 0; x < nx; ++x) {
        const double length =
            std::hypot(mode(x, nx) * impl_->waves[0], mode(y, ny) * impl_->waves[1], mode(z, nz) * impl_->waves[2]);
        impl_->shells.push_back(static_cast<std::size_t>(std::floor(length * (1 + model::shell_rounding / 2) + 0.5)));
      }
    }
  }
  impl_->count = *std::ranges::max_element(impl_->shells) + 1;
}

std::size_t Spectrum::shell_count() const { return impl_->count; }
std::size_t Spectrum::last_resolved() const { return impl_->last_resolved; }
double Spectrum::unit() const { return impl_->unit; }

void Spectrum::add(const std::vector<double>& values, std::vector<double>& energies) {
  impl_->modes.assign(values.begin(), values.end());
  for (std::size_t axis = 0; axis < 3; ++axis) impl_->transform(axis);
  const auto count = static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) energies[impl_->shells[i]] += std::norm(impl_->modes[i] / count) / 2;
}

double distance(const std::vector<double>& energies, const std::vector<double>& of_data, std::size_t first,
                std::size_t last, double noise) {
  double whole = 0, sum = 0, count = 0;
  for (const double energy : of_data) whole += energy;
  for (std::size_t s = first; s <= last && s < std::min(energies.size(), of_data.size()); ++s) {
    if (!(of_data[s] > noise * whole)) continue;
    if (!std::isfinite(energies[s])) return std::numeric_limits<double>::infinity();
    sum += std::abs(std::log10(std::max(energies[s], noise * whole) / of_data[s]));
    ++count;
  }
  return sum / count;
}

/// Rounding to a relative 2^-53 leaves about its square in a mode, for a total energy of 1; here eight times that in
/// magnitude.
double noise_of(Precision real) {
  const double rounding =
      real == Precision::f32 ? std::numeric_limits<float>::epsilon() : std::numeric_limits<double>::epsilon();
  return 64 * rounding * rounding;
}

double correlation(const Components& own, const Components& data) {
  double product = 0, of_own = 0, of_data = 0;
  for (std::size_t c = 0; c < own.size(); ++c) {
    const double mean_own = mean_of(own[c]), mean_data = mean_of(data[c]);
    for (std::size_t i = 0; i < own[c].size(); ++i) {
      const double x = own[c][i] - mean_own, y = data[c][i] - mean_data;
      product += x * y;
      of_own += x * x;
      of_data += y * y;
    }
  }
  if (of_data == 0) return std::numeric_limits<double>::quiet_NaN();
  if (of_own == 0 || !std::isfinite(of_own) || !std::isfinite(of_data)) return 0;
  return product / (std::sqrt(of_own) * std::sqrt(of_data));
}

Crossing first_below(const std::vector<double>& times, const std::vector<double>& course, double threshold) {
  double time = 0, value = 1;
  for (std::size_t k = 0; k < times.size(); ++k) {
    if (std::isnan(course[k])) return {course[k], true};
    if (!(course[k] >= threshold)) {
      const double share = value > course[k] ? (value - threshold) / (value - course[k]) : 0;
      return {time + share * (times[k] - time), true};
    }
    time = times[k];
    value = course[k];
  }
  return {time, false};
}

}  // namespace dpde::training
