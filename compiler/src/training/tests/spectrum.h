// SPDX-License-Identifier: Apache-2.0
// Energy of fields by wave number, on grids whose axes are all periodic and uniform: over shells of whole wave numbers,
// in all directions alike.
#pragma once

#include <memory>
#include <vector>

#include "model/model.h"

namespace dpde::training {

/// Modes exp(i k.x) of a grid by shells: shell s holds those with s - 1/2 <= |k|/unit < s + 1/2, the unit being one
/// wave along the longest axis. Axes of one cell have one mode. Not for several threads at once.
class Spectrum {
 public:
  explicit Spectrum(const std::vector<model::Axis>& axes);
  ~Spectrum();
  Spectrum(Spectrum&&) noexcept;

  std::size_t shell_count() const;
  /// Shells 0 to this one lie wholly below half a wave a cell along every axis.
  std::size_t last_resolved() const;
  /// The wave number of shell 1.
  double unit() const;
  /// Adds the energy of each shell to `energies`; the sum over all of them is mean(values^2)/2 (Parseval).
  void add(const std::vector<double>& values, std::vector<double>& energies);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Mean over shells `first` to `last` of |log10(energy/of_data)|. Shells in which the data have no more than `noise` of
/// their whole energy do not count, and energies below that count as that. Infinite where an energy is not finite; not
/// a number without any shell.
double distance(const std::vector<double>& energies, const std::vector<double>& of_data, std::size_t first,
                std::size_t last, double noise);

/// Energy that rounding of values alone may leave in a shell, in parts of the whole.
double noise_of(Precision real);

/// Of fields with one or several components: sum of a.b over the norms, each component without its mean. NaN where the
/// data do not vary, 0 where only `own` does not, and of what is not finite.
using Components = std::vector<std::vector<double>>;
double correlation(const Components& own, const Components& data);

/// The time at which a course that begins with 1 at time 0 first falls below `threshold`, linear between its values;
/// its last time where it never does, `reached` then false.
struct Crossing {
  double time = 0;  // NaN where the course is
  bool reached = false;
};
Crossing first_below(const std::vector<double>& times, const std::vector<double>& course, double threshold);

}  // namespace dpde::training
