// SPDX-License-Identifier: Apache-2.0
// The waves that a step is looked at for about a frozen point of a scene: all of its grid where that is small, else all
// lengths.
#pragma once

#include <functional>

#include "stability/waves/amplification.h"

namespace dpde::stability {

/// With the mean where long waves do not stand for it. What is solved for may be faster the longer waves are
/// (those of Rossby): without those that are longer than the grid then, and with the longest that it has, which may
/// stand alone.
Largest largest_over_waves(const LinearStep& linear, const FrozenPoint& point, int rank,
                           const std::function<double(const Angles&)>& f);

}  // namespace dpde::stability
