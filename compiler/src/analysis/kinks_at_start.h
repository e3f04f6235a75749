// SPDX-License-Identifier: Apache-2.0
// Whether a task begins on a kink of its loss, as where states are mirror images and `max` has two equal arguments all
// over the grid. There the loss has two slopes along a line, and a gradient is one choice among several: each tie takes
// a side, and by rounding not the same one in every back end. Certificates look beside the start, so they cannot tell.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "driver/scene/inverse.h"

namespace dpde::analysis {

/// By a number, or along a direction in a field.
struct KinkAtStart {
  std::string unknown;
  double ahead, behind;          // the slopes of the loss on both sides
  double gradient;               // what the gradient says
  bool is_along_a_line = false;  // in which the values of a field move by 0.5 to 1.5 each
};

/// One entry for each unknown along whose direction the slopes differ, for steps as small as rounding lets them be
/// told.
/// A direction in all unknowns is looked at first: where that has one slope, the others are not.
std::vector<KinkAtStart> kinks_at_start(driver::Inverse& inverse, std::mt19937_64& random);

/// Whether the loss and its gradient are.
bool is_finite_at_start(driver::Inverse& inverse);

/// What jumps in the run, and in which step; "" where nothing does.
std::string jump_at_start(driver::Session& session, driver::Inverse& inverse);

}  // namespace dpde::analysis
