// SPDX-License-Identifier: Apache-2.0
// The waves that are checked about a frozen point of a scene: all modes of a small grid, else waves of all lengths.
#pragma once

#include <functional>

#include "stability/waves/amplification.h"

namespace dpde::stability {

/// The largest value of `f` over these waves, and the mean if long waves do not represent it. With solves, frequencies
/// may rise with the wavelength (Rossby waves): waves longer than the grid are then left out, and the grid's longest
/// waves are included, which may be isolated.
Largest largest_over_waves(const LinearStep& linear, const FrozenPoint& point, int rank,
                           const std::function<double(const Angles&)>& f);

}  // namespace dpde::stability
