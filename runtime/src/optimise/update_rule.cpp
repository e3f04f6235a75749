// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/update_rule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dpde {
namespace {

constexpr double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;  // usual values of Adam

}  // namespace

double RateSchedule::factor(std::int64_t k, std::int64_t updates) const {
  switch (kind) {
    case Kind::constant: break;
    case Kind::halve: return std::exp2(-static_cast<double>(k / every));
    case Kind::cosine:
      return (1 + std::cos(std::numbers::pi * static_cast<double>(k) /
                           static_cast<double>(std::max<std::int64_t>(updates, 1)))) /
             2;
  }
  return 1;
}

UpdateState begin_updates(const UpdateRule& rule, const Eigen::VectorXd& x) {
  UpdateState state{x, Eigen::VectorXd::Zero(x.size()), {}, 0};
  if (rule.kind == UpdateRule::Kind::adam) state.square = state.mean;
  return state;
}

void update(const UpdateRule& rule, UpdateState& state, Eigen::VectorXd& gradient, std::int64_t updates,
            const Bounds& bounds) {
  const double length = gradient.norm();
  if (rule.clip > 0 && length > rule.clip) gradient *= rule.clip / length;
  const double rate = rule.rate * rule.schedule.factor(state.made, updates);
  ++state.made;
  if (rule.decay > 0) state.x *= 1 - rate * rule.decay;
  if (rule.kind == UpdateRule::Kind::gradient_descent) {
    state.mean = rule.momentum * state.mean + gradient;
    state.x -= rate * state.mean;
  } else {
    state.mean = beta1 * state.mean + (1 - beta1) * gradient;
    state.square = beta2 * state.square + (1 - beta2) * gradient.cwiseAbs2();
    const auto k = static_cast<double>(state.made);
    const double mean_scale = 1 / (1 - std::pow(beta1, k)), square_scale = 1 / (1 - std::pow(beta2, k));
    state.x.array() -=
        rate * mean_scale * state.mean.array() / ((square_scale * state.square.array()).sqrt() + epsilon);
  }
  bounds.project(state.x);
}

}  // namespace dpde
