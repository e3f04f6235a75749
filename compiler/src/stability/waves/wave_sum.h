// SPDX-License-Identifier: Apache-2.0
// What a transform makes of perturbations: sums of displaced ones whose waves are multiplied; what a solve makes of
// them: a sum whose waves are divided. It is a component of its own in other sums, as its numbers are different for
// each wave.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <vector>

#include "stability/waves/linear_form.h"
#include "support/wave_function.h"

namespace dpde::stability {

/// coefficient times (i*angle)^power for each axis, angles in radians a cell; 0 for waves of two cells along those
/// where it vanishes.
struct NumberMonomial {
  double coefficient = 0;
  std::array<int, 3> powers{};
  std::array<bool, 3> vanishes{};
};

/// A multiplier of stencil.h with numbers in it.
struct WaveMultiplier {
  WaveFunction function = {};
  std::vector<NumberMonomial> argument, factor;
  bool within_two_thirds = false;
  std::array<bool, 3> means = {};  // along these axes it takes the mean: no waves are left

  std::complex<double> at(const std::array<double, 3>& angles) const;
  static WaveMultiplier one() { return {{}, {}, {{1, {}}}, false}; }
  /// The same for all waves.
  bool is_constant() const;
  /// Or not known, as of 1/dt with dt = 0.
  bool is_zero() const;
  /// Divides waves by what an operator makes of them: what it gives at a point depends on all places.
  bool solves() const;
  /// Of what is the same everywhere, and for each axis of what grows by 1 a cell along it.
  double of_constant() const;
  std::array<double, 3> of_slopes() const;
  /// Of what grows by 1 a cell along the axis and is 0 at the point, times a wave: M(D)(x f) = x M(D) f + M'(D) f,
  /// where M' is the sum of these. `argument`: what is taken for its own in its derivative.
  std::vector<WaveMultiplier> derivatives(std::size_t axis, const std::vector<NumberMonomial>& argument) const;
};

/// What a transform or a solve gives.
struct WaveSum {
  struct Term {
    LinearForm form;
    WaveMultiplier by;
  };
  std::vector<Term> terms;
  LinearForm divisor = {};  // of component 0: by what this makes of a wave of amplitude 1; none where it is zero

  bool is_finite() const;
};

}  // namespace dpde::stability
