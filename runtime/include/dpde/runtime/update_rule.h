// SPDX-License-Identifier: Apache-2.0
// Updates by gradients that change from one to the next, as those of mini-batches do: gradient descent with momentum,
// and Adam, with decay, clipping and a rate that falls. Deterministic: equal gradients give equal values.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dpde/runtime/optimise.h"

namespace dpde {

/// How the rate changes from update to update.
struct RateSchedule {
  enum class Kind { constant, halve, cosine } kind = Kind::constant;
  int every = 1;  // halve: so many updates
  /// Times the first rate, before update k = 0, 1, ... of `updates`. cosine: from 1 down to 0 along half a wave.
  double factor(std::int64_t k, std::int64_t updates) const;
};

struct UpdateRule {
  enum class Kind { gradient_descent, adam } kind = Kind::adam;
  double rate = 1e-3;
  double momentum = 0;  // of gradient descent: m = momentum*m + gradient, x -= rate*m
  double decay = 0;     // x -= rate*decay*x beside the update (AdamW)
  double clip = 0;      // > 0: a longer gradient is shortened to this length
  RateSchedule schedule;
};

/// The values and what the rule remembers of earlier gradients.
struct UpdateState {
  Eigen::VectorXd x, mean, square;  // `square`: of adam
  std::int64_t made = 0;            // updates
};
UpdateState begin_updates(const UpdateRule& rule, const Eigen::VectorXd& x);

/// Makes one update of `updates` in all, then projects onto the bounds. `gradient` is shortened where it is clipped.
void update(const UpdateRule& rule, UpdateState& state, Eigen::VectorXd& gradient, std::int64_t updates,
            const Bounds& bounds = {});

}  // namespace dpde
