// SPDX-License-Identifier: Apache-2.0
// Updates with stochastic gradients, as of mini-batches: gradient descent with momentum, and Adam, with decay, clipping
// and a learning-rate schedule. Deterministic: equal gradients give equal values.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dpde/runtime/optimise.h"

namespace dpde {

/// The learning rate from update to update.
struct RateSchedule {
  enum class Kind { constant, halve, cosine } kind = Kind::constant;
  int every = 1;  // halve: after so many updates
  /// Factor of the first rate, before update k = 0, 1, ... of `updates`. cosine: from 1 down to 0 along half a wave.
  double factor(std::int64_t k, std::int64_t updates) const;
};

struct UpdateRule {
  enum class Kind { gradient_descent, adam } kind = Kind::adam;
  double rate = 1e-3;
  double momentum = 0;  // gradient descent: m = momentum*m + gradient, x -= rate*m
  double decay = 0;     // additionally x -= rate*decay*x (AdamW)
  double clip = 0;      // > 0: a longer gradient is scaled to this norm
  RateSchedule schedule;
};

/// The values and the moments of earlier gradients.
struct UpdateState {
  Eigen::VectorXd x, mean, square;  // `square`: of adam
  std::int64_t made = 0;            // updates
};
UpdateState begin_updates(const UpdateRule& rule, const Eigen::VectorXd& x);

/// Makes one update of `updates` in all, then projects onto the bounds. Clipping scales `gradient` in place.
void update(const UpdateRule& rule, UpdateState& state, Eigen::VectorXd& gradient, std::int64_t updates,
            const Bounds& bounds = {});

}  // namespace dpde
