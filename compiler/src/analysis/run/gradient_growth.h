// SPDX-License-Identifier: Apache-2.0
// Whether a gradient is still accurate. The adjoint of a chaotic run grows backwards as perturbations grow forwards, as
// exp(rate*time). Rounding is such a perturbation: once it has grown to the size of the state, the gradient belongs to
// one run that other rounding would not reproduce.
#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

/// If grown perturbations stay below this part of the state, a gradient has three digits.
constexpr double largest_rounding = 1e-3;

/// Observes one gradient of a session, at the cost of a norm of the adjoint at some steps.
class AdjointWatch {
 public:
  /// `steps`: approximate number of steps of the reverse sweep.
  AdjointWatch(driver::Session& session, int steps);
  ~AdjointWatch();
  AdjointWatch(const AdjointWatch&) = delete;
  AdjointWatch& operator=(const AdjointWatch&) = delete;

  struct Look {
    double time, norm;  // of the state's adjoint at that time
  };
  /// From the end to the beginning of the run.
  const std::vector<Look>& looks() const { return looks_; }

 private:
  driver::Session& session_;
  std::vector<Look> looks_;
};

/// Growth of a quantity as exp(rate*time).
struct Growth {
  double rate = 0;       // 1/time: slope of the logarithm over the interval
  double logarithm = 0;  // of the largest growth within the interval
};
/// For the adjoint, backwards in time; nullopt for fewer than three samples.
std::optional<Growth> growth_of_adjoint(const std::vector<AdjointWatch::Look>& looks);

/// For a small random perturbation of the initial state: two runs whose difference is rescaled repeatedly (G. Benettin,
/// L. Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15 (1980)).
struct PerturbationGrowth {
  Growth growth;
  double relative = 0;  // ln of (final perturbation / final state) for a relative initial perturbation of 1
  /// Time from the beginning, and ln of the perturbation relative to the state at that time.
  std::vector<std::pair<double, double>> course;
};
/// Largest time until which no perturbation of the course has grown by more than `most` (ln) since its minimum.
double time_within(const std::vector<std::pair<double, double>>& course, double most);
/// Over `steps` steps of the scene's dt divided by `parts`. nullopt if a run blows up. Changes the session's present
/// state.
std::optional<PerturbationGrowth> growth_of_perturbation(driver::Session& session, int steps, int parts = 1);

struct GradientGrowth {
  Growth adjoint;
  double window = 0;                                             // time from the beginning to the last loss
  std::optional<PerturbationGrowth> perturbation, at_half_step;  // if the adjoint has grown much
  double rounding = 0;                                           // relative rounding of state or gradient
  bool is_of_gradient = false;                                   // it lost its digits before the states did
  double safe_window = 0;  // time within which rounding stays small; for a lost gradient
  bool is_lost() const { return rounding > largest_rounding; }
  /// Whether the growth is a property of the equations and not of the scheme: it is the same with half the step.
  /// nullopt: unknown.
  std::optional<bool> is_of_equations() const;
};
/// Judges an observed gradient; nullopt if there are too few samples. `beside`: returns the gradient's relative change
/// if its point is perturbed by a rounding; called if the adjoint has grown much. The gradient may lose digits before
/// the states do, as the states' divergence depends on the point. Changes the session's states.
std::optional<GradientGrowth> gradient_growth(driver::Session& session, const std::vector<AdjointWatch::Look>& looks,
                                              const std::function<double()>& beside = {});

}  // namespace dpde::analysis
