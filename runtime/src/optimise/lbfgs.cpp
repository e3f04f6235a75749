// SPDX-License-Identifier: Apache-2.0
// Limited-memory BFGS (Nocedal and Wright, Numerical Optimization, algorithms 7.4, 3.5 and 3.6).
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>

#include "dpde/runtime/unknown_scales.h"
#include "optimise/minimiser.h"

namespace dpde {
namespace {

constexpr double sufficient_decrease = 1e-4, curvature = 0.9;
constexpr int most_trials = 40, most_rounded_trials = 3;
constexpr double least_growth = 2.5, most_growth = 100;  // factor of a step that is too short
constexpr double longest_step = 1e10;

/// A point along the search line: step length, loss, slope (gradient times direction).
struct Trial {
  double step = 0, loss = 0, slope = 0;
};

/// Minimiser of the cubic through two trials, kept inside the middle 80 % of the interval between them.
double interpolate(const Trial& a, const Trial& b) {
  const double low = std::min(a.step, b.step), high = std::max(a.step, b.step), margin = 0.1 * (high - low);
  const double d1 = a.slope + b.slope - 3 * (a.loss - b.loss) / (a.step - b.step);
  const double d2 = std::copysign(std::sqrt(d1 * d1 - a.slope * b.slope), b.step - a.step);
  const double step = b.step - (b.step - a.step) * (b.slope + d2 - d1) / (b.slope - a.slope + 2 * d2);
  return std::isfinite(step) ? std::clamp(step, low + margin, high - margin) : 0.5 * (low + high);
}

/// Finds a step along `direction` that satisfies the strong Wolfe conditions, or at least lowers the loss.
class LineSearch {
 public:
  LineSearch(Minimiser& minimiser, const Eigen::VectorXd& from, const Eigen::VectorXd& direction, const Trial& start)
      : minimiser_(minimiser),
        from_(from),
        direction_(direction),
        start_(start),
        best_(start),
        gradient_(from.size()) {}

  /// Returns false if no step lowers the loss; else x, gradient and loss are those of the best step.
  bool run(double first_step) {
    Trial before = start_;
    double step = first_step;
    while (goes_on() && step < longest_step) {
      const std::optional<Trial> trial = evaluate(step);
      if (!trial) {  // not finite: shorten towards the last good step
        step = before.step + 0.25 * (step - before.step);
        continue;
      }
      if (accepted(*trial)) return true;
      if (too_high(*trial) || (before.step > 0 && trial->loss >= before.loss)) return zoom(before, *trial);
      if (trial->slope >= 0) return zoom(*trial, before);
      before = *trial;
      step *= 2.5;
    }
    return best_.step > 0;
  }
  const Eigen::VectorXd& x() const { return best_x_; }
  const Eigen::VectorXd& gradient() const { return best_gradient_; }
  double loss() const { return best_.loss; }

 private:
  bool goes_on() const { return trials_ < most_trials && rounded_trials_ < most_rounded_trials; }
  bool too_high(const Trial& trial) const {
    return trial.loss > start_.loss + sufficient_decrease * trial.step * start_.slope;
  }
  bool accepted(const Trial& trial) const {
    return !too_high(trial) && std::abs(trial.slope) <= -curvature * start_.slope;
  }

  std::optional<Trial> evaluate(double step) {
    ++trials_;
    x_ = from_ + step * direction_;
    Trial trial{step, 0, 0};
    if (!minimiser_.evaluate(x_, trial.loss, gradient_)) return std::nullopt;
    trial.slope = gradient_.dot(direction_);
    if (minimiser_.is_rounding(start_.loss, trial.loss - start_.loss, 0.5 * step * (start_.slope + trial.slope)))
      ++rounded_trials_;
    if (trial.loss < best_.loss || (accepted(trial) && trial.loss <= best_.loss)) {
      best_ = trial;
      best_x_ = x_;
      best_gradient_ = gradient_;
    }
    return trial;
  }

  /// `low` has the smaller loss, and its slope points towards `high`.
  bool zoom(Trial low, Trial high) {
    while (goes_on() && std::abs(high.step - low.step) > 1e-16 * std::max(low.step, high.step)) {
      const double step = interpolate(low, high);
      const std::optional<Trial> trial = evaluate(step);
      if (!trial) {  // not finite: search below this step
        high = {step, std::numeric_limits<double>::infinity(), 0};
        continue;
      }
      if (accepted(*trial)) return true;
      if (too_high(*trial) || trial->loss >= low.loss) {
        high = *trial;
        continue;
      }
      if (trial->slope * (high.step - low.step) >= 0) high = low;
      low = *trial;
    }
    return best_.step > 0;
  }

  Minimiser& minimiser_;
  const Eigen::VectorXd& from_;
  const Eigen::VectorXd& direction_;
  Trial start_, best_;
  Eigen::VectorXd x_, gradient_, best_x_, best_gradient_;
  int trials_ = 0, rounded_trials_ = 0;
};

using Pair = LbfgsState::Pair;

/// The scale of each unknown; empty: all are 1. The method works on unknowns divided by these: L-BFGS starts from a
/// multiple of the unit matrix, far from any Hessian if unknowns have units of different sizes.
using Scale = Eigen::VectorXd;

Eigen::VectorXd scaled(const Eigen::VectorXd& gradient, const Scale& scale) {
  return scale.size() == 0 ? gradient : Eigen::VectorXd(gradient.cwiseProduct(scale));
}
Eigen::VectorXd steepest(const Eigen::VectorXd& gradient, const Scale& scale) {
  return -scaled(scaled(gradient, scale), scale);
}

/// Sizes; unknown ones from a gradient, so that they change the loss, to first order, as much as the largest known one.
std::vector<double> sizes_of(const std::vector<UnknownScale>& scales, const Eigen::VectorXd& gradient) {
  const auto slope_of = [&](const UnknownScale& part) { return gradient.segment(part.first, part.count).stableNorm(); };
  double most = 0;
  for (const UnknownScale& part : scales) most = std::max(most, part.size * slope_of(part));
  std::vector<double> sizes;
  for (const UnknownScale& part : scales) {
    const double own = most / slope_of(part);
    sizes.push_back(part.size > 0 ? part.size : most > 0 && std::isfinite(own) ? own : 1);
  }
  return sizes;
}

Scale scale_by(const std::vector<UnknownScale>& scales, const std::vector<double>& sizes, Eigen::Index count) {
  if (scales.empty()) return {};
  Scale scale = Scale::Ones(count);
  for (size_t i = 0; i < scales.size(); ++i) scale.segment(scales[i].first, scales[i].count).setConstant(sizes[i]);
  return scale;
}

/// The two-loop recursion: minus the approximate inverse Hessian times the gradient.
Eigen::VectorXd direction_of(const std::deque<Pair>& pairs, const Eigen::VectorXd& gradient, const Scale& scale) {
  Eigen::VectorXd q = -gradient;
  std::vector<double> alphas(pairs.size());
  for (size_t i = pairs.size(); i-- > 0;) {
    alphas[i] = pairs[i].rho * pairs[i].step.dot(q);
    q -= alphas[i] * pairs[i].change;
  }
  q = scaled(scaled(q, scale), scale);
  if (!pairs.empty()) q *= 1 / (pairs.back().rho * scaled(pairs.back().change, scale).squaredNorm());
  for (size_t i = 0; i < pairs.size(); ++i) q += (alphas[i] - pairs[i].rho * pairs[i].change.dot(q)) * pairs[i].step;
  return q;
}

void remember(std::deque<Pair>& pairs, size_t memory, Eigen::VectorXd step, Eigen::VectorXd change,
              const Scale& scale) {
  const double product = step.dot(change);
  const double length = scale.size() == 0 ? step.norm() : step.cwiseQuotient(scale).norm();
  if (!(product > 1e-14 * length * scaled(change, scale).norm())) return;  // keeps the approximation positive definite
  if (pairs.size() == memory) pairs.pop_front();
  pairs.push_back({std::move(step), std::move(change), 1 / product});
}

/// A point of the projected path x + t*direction.
struct PathPoint {
  Eigen::VectorXd x, gradient;
  double loss = 0, expected = 0;  // expected: the change by the slope at the start
  double slope = 0;               // over components that have not reached a bound
};

class PathSearch {
 public:
  PathSearch(Minimiser& minimiser, const LbfgsState& from, const Eigen::VectorXd& direction)
      : minimiser_(minimiser), from_(from), direction_(direction), start_slope_(from.gradient.dot(direction)) {}

  /// Shortens the step until the loss has decreased enough; lengthens the first one while the loss falls about as
  /// steeply as at the start.
  bool run(double step) {
    int rounded = 0;
    for (int k = 0; k < most_trials && rounded < most_rounded_trials && step < longest_step; ++k) {
      const bool is_finite = evaluate(step);
      if (!(trial_.expected < 0)) return found_;
      const double change = trial_.loss - from_.loss;
      if (is_finite &&
          minimiser_.is_rounding(from_.loss, change, 0.5 * (from_.gradient + trial_.gradient).dot(trial_.x - from_.x)))
        ++rounded;
      if (!is_finite || change > sufficient_decrease * trial_.expected || (found_ && trial_.loss >= best_.loss)) {
        if (found_) return true;
        step /= 2;
        is_shortened_ = true;
        continue;
      }
      best_ = trial_;
      found_ = true;
      if (is_shortened_ || !(trial_.slope < curvature * start_slope_)) return true;
      const double growth = start_slope_ / (start_slope_ - trial_.slope);  // extrapolates to where the slope vanishes
      step *= growth > 0 && growth < most_growth ? std::max(growth, least_growth) : most_growth;
    }
    return found_;
  }
  const PathPoint& best() const { return best_; }

 private:
  bool evaluate(double step) {
    trial_.x = from_.x + step * direction_;
    const Eigen::VectorXd beyond = trial_.x;
    minimiser_.bounds.project(trial_.x);
    trial_.expected = from_.gradient.dot(trial_.x - from_.x);
    trial_.gradient.resize(trial_.x.size());
    if (!(trial_.expected < 0) || !minimiser_.evaluate(trial_.x, trial_.loss, trial_.gradient)) return false;
    trial_.slope = 0;
    for (Eigen::Index i = 0; i < beyond.size(); ++i)
      trial_.slope += trial_.x[i] == beyond[i] ? trial_.gradient[i] * direction_[i] : 0.0;
    return true;
  }

  Minimiser& minimiser_;
  const LbfgsState& from_;
  const Eigen::VectorXd& direction_;
  double start_slope_;
  PathPoint trial_, best_;
  bool found_ = false, is_shortened_ = false;
};

/// Returns false if no step along the projected path lowers the loss enough.
bool search_within(Minimiser& minimiser, LbfgsState& state, const Eigen::VectorXd& direction, double first,
                   size_t memory, const Scale& scale) {
  PathSearch search(minimiser, state, direction);
  if (!search.run(first)) return false;
  remember(state.pairs, memory, search.best().x - state.x, search.best().gradient - state.gradient, scale);
  state.x = search.best().x;
  state.gradient = search.best().gradient;
  state.loss = search.best().loss;
  return true;
}

/// The pairs restricted to free components: those at their bounds do not contribute to the curvature.
std::deque<Pair> free_part(const std::deque<Pair>& pairs, const Bounds& bounds, const LbfgsState& state,
                           const Scale& scale) {
  std::deque<Pair> parts;
  for (const Pair& pair : pairs) {
    Eigen::VectorXd step = pair.step, change = pair.change;
    bounds.keep_free(state.x, state.gradient, step);
    bounds.keep_free(state.x, state.gradient, change);
    remember(parts, pairs.size(), std::move(step), std::move(change), scale);
  }
  return parts;
}

bool move_within(Minimiser& minimiser, LbfgsState& state, size_t memory, const Scale& scale) {
  Eigen::VectorXd free = state.gradient;
  minimiser.bounds.keep_free(state.x, state.gradient, free);
  const Eigen::VectorXd direction = direction_of(free_part(state.pairs, minimiser.bounds, state, scale), free, scale);
  const double careful = std::min(1.0, 1 / scaled(free, scale).lpNorm<1>());
  if (search_within(minimiser, state, direction, state.pairs.empty() ? careful : 1.0, memory, scale)) return true;
  state.pairs.clear();
  return search_within(minimiser, state, steepest(free, scale), careful, memory, scale);
}

bool move_along(Minimiser& minimiser, LbfgsState& state, const Eigen::VectorXd& direction, double first_step,
                size_t memory, const Scale& scale) {
  const double slope = state.gradient.dot(direction);
  if (!(slope < 0)) return false;
  LineSearch search(minimiser, state.x, direction, {0, state.loss, slope});
  if (!search.run(first_step)) return false;
  remember(state.pairs, memory, search.x() - state.x, search.gradient() - state.gradient, scale);
  state.x = search.x();
  state.gradient = search.gradient();
  state.loss = search.loss();
  return true;
}

bool move(const Lbfgs& method, Minimiser& minimiser, LbfgsState& state, const Scale& scale) {
  const auto memory = static_cast<size_t>(std::max(method.memory, 1));
  if (!minimiser.bounds.empty()) return move_within(minimiser, state, memory, scale);
  const double careful = std::min(1.0, 1 / scaled(state.gradient, scale).lpNorm<1>());
  if (move_along(minimiser, state, direction_of(state.pairs, state.gradient, scale),
                 state.pairs.empty() ? careful : 1.0, memory, scale))
    return true;
  if (state.pairs.empty()) return false;
  state.pairs.clear();
  return move_along(minimiser, state, steepest(state.gradient, scale), careful, memory, scale);
}

double free_norm(const Bounds& bounds, const Eigen::VectorXd& x, const Eigen::VectorXd& gradient, const Scale& scale) {
  Eigen::VectorXd free = gradient;
  bounds.keep_free(x, gradient, free);
  return scaled(free, scale).norm();
}

}  // namespace

Eigen::VectorXd scale_of(const std::vector<UnknownScale>& scales, const Eigen::VectorXd& gradient) {
  return scale_by(scales, sizes_of(scales, gradient), gradient.size());
}

bool iterate(const Lbfgs& method, LbfgsState& state, const Eigen::VectorXd& scale, const Objective& objective,
             const Bounds& bounds) {
  const IterationObserver nobody;
  Minimiser minimiser{objective, nobody, 1, 0, bounds, {}, {}, 0};
  return move(method, minimiser, state, scale);
}

ScaledResult minimise_scaled(const Lbfgs& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                             const std::vector<UnknownScale>& scales, const IterationObserver& observer,
                             double gradient_tolerance, const Bounds& bounds) {
  Minimiser minimiser{objective, observer, iterations, gradient_tolerance, bounds, {}, {}, 0};
  LbfgsState state;
  state.x = std::move(x);
  bounds.project(state.x);
  const bool finite = minimiser.start(state.x, state.loss, state.gradient);
  const std::vector<double> sizes = sizes_of(scales, state.gradient);
  const Scale scale = scale_by(scales, sizes, state.x.size());
  for (bool is_rounding = false; minimiser.visit(state.x, state.loss, state.gradient, finite);) {
    if (is_rounding) {
      minimiser.stop(StopReason::no_progress);
      break;
    }
    const Eigen::VectorXd before = state.x, gradient = state.gradient;
    const double loss = state.loss;
    if (!move(method, minimiser, state, scale)) {
      minimiser.stop(StopReason::no_progress);
      break;
    }
    ++minimiser.result.iterations;
    // The gradient still has accurate digits when changes of the loss are rounding: continue while it decreases.
    const bool falls =
        free_norm(bounds, state.x, state.gradient, scale) < 0.5 * free_norm(bounds, before, gradient, scale);
    is_rounding = !falls && minimiser.is_rounding(state.loss, state.loss - loss,
                                                  0.5 * (gradient + state.gradient).dot(state.x - before));
  }
  return {std::move(minimiser.result), sizes};
}

OptimiseResult minimise(const Lbfgs& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer, double gradient_tolerance, const Bounds& bounds) {
  return minimise_scaled(method, objective, std::move(x), iterations, {}, observer, gradient_tolerance, bounds).result;
}

}  // namespace dpde
