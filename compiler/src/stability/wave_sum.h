// SPDX-License-Identifier: Apache-2.0
// What a transform makes of perturbations: sums of displaced ones whose waves are multiplied. It is a component of its
// own in other sums, as its numbers are different for each wave.
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "stability/form.h"

namespace dpde::stability {

/// coefficient times (i*angle)^power for each axis, angles in radians a cell.
struct NumberMonomial {
  double coefficient = 0;
  std::array<int, 3> powers{};
};

/// A multiplier of stencil.h with numbers in it.
struct WaveMultiplier {
  int phi = -1;  // -1: none
  std::vector<NumberMonomial> argument, factor;
  bool within_two_thirds = false;

  std::complex<double> at(const std::array<double, 3>& angles) const;
  /// The same for all waves.
  bool is_constant() const;
  /// Of what is the same everywhere, and for each axis of what grows by 1 a cell along it.
  double of_constant() const { return at({}).real(); }
  std::array<double, 3> of_slopes() const;
};

/// What a transform gives.
struct WaveSum {
  struct Term {
    Form form;
    WaveMultiplier by;
  };
  std::vector<Term> terms;
};

}  // namespace dpde::stability
