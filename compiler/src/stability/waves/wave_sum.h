// SPDX-License-Identifier: Apache-2.0
// Perturbations after a transform (linear forms whose waves are multiplied) or after a solve (a sum whose waves are
// divided). A WaveSum is a component of its own in other forms, as its factor differs from wave to wave.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <vector>

#include "stability/waves/linear_form.h"
#include "support/wave_function.h"

namespace dpde::stability {

/// coefficient * product over axes of (i*angle)^power, angles in radians per cell; 0 for waves of two cells along axes
/// with `vanishes`.
struct NumberMonomial {
  double coefficient = 0;
  std::array<int, 3> powers{};
  std::array<bool, 3> vanishes{};
};

/// A multiplier of stencil.h with its parameters replaced by numbers.
struct WaveMultiplier {
  WaveFunction function = {};
  std::vector<NumberMonomial> argument, factor;
  bool within_two_thirds = false;
  std::array<bool, 3> means = {};  // along these axes it takes the mean: only constants remain

  std::complex<double> at(const std::array<double, 3>& angles) const;
  static WaveMultiplier one() { return {{}, {}, {{1, {}}}, false}; }
  /// Whether the multiplier is the same for all waves.
  bool is_constant() const;
  /// Whether it is 0 or not known, as 1/dt with dt = 0.
  bool is_zero() const;
  /// Whether it divides waves by an operator's symbol: its value at a point then depends on all points.
  bool solves() const;
  /// The factor of a constant field, and for each axis that of a field with slope 1 per cell along it.
  double of_constant() const;
  std::array<double, 3> of_slopes() const;
  /// M' for x (in cells along the axis, 0 at the point) times a wave f: M(D)(x f) = x M(D) f + M'(D) f. M' is the sum
  /// of the returned multipliers. `argument`: used instead of the multiplier's own in its derivative.
  std::vector<WaveMultiplier> derivatives(std::size_t axis, const std::vector<NumberMonomial>& argument) const;
};

/// The result of a transform or a solve.
struct WaveSum {
  struct Term {
    LinearForm form;
    WaveMultiplier by;
  };
  std::vector<Term> terms;
  LinearForm divisor = {};  // of component 0: divides by its value for a wave of amplitude 1; empty: no division

  bool is_finite() const;
};

}  // namespace dpde::stability
