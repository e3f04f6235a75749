// SPDX-License-Identifier: Apache-2.0
// Whether a task starts on a kink of its loss, for example if states are symmetric and `max` has equal arguments
// everywhere. The loss then has two slopes along a line, and a gradient is an arbitrary choice among them: each tie
// takes a side, by rounding not the same in every back end. Certificates test a nearby point and cannot see this.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "driver/scene/inverse.h"

namespace dpde::analysis {

/// For a number, or along a direction in a field.
struct KinkAtStart {
  std::string unknown;
  double ahead, behind;          // one-sided slopes of the loss
  double gradient;               // derivative by the gradient
  bool is_along_a_line = false;  // in which each value of a field moves by 0.5 to 1.5
};

/// One entry for each unknown along whose direction the one-sided slopes differ, down to steps limited by rounding. A
/// direction in all unknowns is checked first; if that has no kink, single unknowns are skipped.
std::vector<KinkAtStart> kinks_at_start(driver::Inverse& inverse, std::mt19937_64& random);

/// Whether the loss and its gradient are finite at the start.
bool is_finite_at_start(driver::Inverse& inverse);

/// What jumps in the run, and in which step; "" if nothing.
std::string jump_at_start(driver::Session& session, driver::Inverse& inverse);

}  // namespace dpde::analysis
