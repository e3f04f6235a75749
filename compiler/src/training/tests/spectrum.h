// SPDX-License-Identifier: Apache-2.0
// Energy spectrum of fields by wave number, on grids with periodic, uniform axes: sums over shells of integer wave
// numbers.
#pragma once

#include <memory>
#include <vector>

#include "model/model.h"

namespace dpde::training {

/// Modes exp(i k.x) of a grid in shells: shell s has the modes with s - 1/2 <= |k|/unit < s + 1/2, where the unit is
/// one wave along the longest axis. Axes of one cell have one mode. Not thread-safe.
class Spectrum {
 public:
  explicit Spectrum(const std::vector<model::Axis>& axes);
  ~Spectrum();
  Spectrum(Spectrum&&) noexcept;

  std::size_t shell_count() const;
  /// Shells 0 to this one are completely below the Nyquist wave number of every axis.
  std::size_t last_resolved() const;
  /// Wave number of shell 1.
  double unit() const;
  /// Adds the energy of each shell to `energies`; the sum over all of them is mean(values^2)/2 (Parseval).
  void add(const std::vector<double>& values, std::vector<double>& energies);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Mean over shells `first` to `last` of |log10(energy/of_data)|. Omits shells in which the data have at most `noise`
/// of their total energy; smaller energies count as that. Infinite if an energy is not finite; NaN without any shell.
double distance(const std::vector<double>& energies, const std::vector<double>& of_data, std::size_t first,
                std::size_t last, double noise);

/// Energy in a shell due to rounding of values, relative to the total.
double noise_of(Precision real);

/// Correlation of fields with one or several components: sum of a.b over the norms, each component without its mean.
/// NaN if the data are constant; 0 if only `own` is constant, and for values that are not finite.
using Components = std::vector<std::vector<double>>;
double correlation(const Components& own, const Components& data);

/// First time at which a series, which is 1 at time 0, falls below `threshold`, with linear interpolation. If it never
/// does: its last time, with `reached` false.
struct Crossing {
  double time = 0;  // NaN if the series has a NaN
  bool reached = false;
};
Crossing first_below(const std::vector<double>& times, const std::vector<double>& course, double threshold);

}  // namespace dpde::training
