// SPDX-License-Identifier: Apache-2.0
#include "run/forward/part_control.h"

#include <algorithm>
#include <cmath>

namespace dpde {
namespace {

constexpr double safety = 0.9, most_change = 5, least_error_before = 1e-4;

}  // namespace

void PartControl::begin(int first) {
  record_.begin(first);
  if (first == 0 || state_.length == 0) state_ = {first_length_, 1, false};
}

/// A substep that is shortened because of the step's end leaves a rest that is no shorter than itself.
double PartControl::length(double rest) const {
  return state_.length >= rest * (1 - 1e-9) ? rest : std::min(state_.length, rest / 2);
}

void PartControl::accept(const PartOfStep& part, double error) {
  const double now = std::max(error, 1e-10);
  const double factor = safety * std::pow(now, -0.85 / order_) * std::pow(state_.error, 0.2 / order_);
  const double most = state_.has_refused ? 1 : most_change;
  const double next = part.length * std::clamp(factor, 1 / most_change, most);
  // A substep cut short by the end of the step does not reduce the intended length.
  state_.length = part.length < state_.length ? std::max(next, state_.length) : next;
  state_.error = std::max(error, least_error_before);
  state_.has_refused = false;
  record(part);
}

void PartControl::refuse(const PartOfStep& part, double error) {
  const double factor = std::isfinite(error) ? safety * std::pow(error, -1.0 / order_) : 0;
  state_.length = part.length * std::max(factor, 1 / most_change);
  state_.has_refused = true;
}

}  // namespace dpde
