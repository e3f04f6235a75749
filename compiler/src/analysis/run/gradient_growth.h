// SPDX-License-Identifier: Apache-2.0
// Whether a gradient still has digits. On its way back the adjoint of a chaotic run grows as a perturbation of the run
// does forward, exp(rate*time). Rounding is such a perturbation: where it has grown to the size of the state, the
// gradient is exactly that of a run that no other rounding would make.
#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

/// Perturbations that grow by less than this over their rounding leave a gradient three digits.
constexpr double largest_rounding = 1e-3;

/// Watches one gradient of a session; what it costs is a norm of the adjoint at some of its steps.
class AdjointWatch {
 public:
  /// `steps` that the gradient goes back over, about.
  AdjointWatch(driver::Session& session, int steps);
  ~AdjointWatch();
  AdjointWatch(const AdjointWatch&) = delete;
  AdjointWatch& operator=(const AdjointWatch&) = delete;

  struct Look {
    double time, norm;  // of the adjoint of the state at that time
  };
  /// From the end to the begin of the run.
  const std::vector<Look>& looks() const { return looks_; }

 private:
  driver::Session& session_;
  std::vector<Look> looks_;
};

/// Of a quantity that grows as exp(rate*time).
struct Growth {
  double rate = 0;       // 1/time: the slope of the logarithm over the window
  double logarithm = 0;  // of the largest growth within the window
};
/// Of the adjoint, backwards in time; nullopt with fewer than three looks.
std::optional<Growth> growth_of_adjoint(const std::vector<AdjointWatch::Look>& looks);

/// Of a small random perturbation of the initial state, by two runs side by side whose distance is made small again
/// and again (G. Benettin, L. Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15 (1980)).
struct PerturbationGrowth {
  Growth growth;
  double relative = 0;  // ln of what a perturbation of 1 part of the first state is in parts of the last
  /// Time from the begin, and ln of what such a perturbation is in parts of the state then.
  std::vector<std::pair<double, double>> course;
};
/// Up to when no perturbation of the course has grown by more than `most` (ln) since it was smallest.
double time_within(const std::vector<std::pair<double, double>>& course, double most);
/// Over `steps` steps of dt = the scene's over `parts`. nullopt where a run leaves all bounds. The session's present
/// state is another one afterwards.
std::optional<PerturbationGrowth> growth_of_perturbation(driver::Session& session, int steps, int parts = 1);

struct GradientGrowth {
  Growth adjoint;
  double window = 0;                                             // time from the begin to the last loss
  std::optional<PerturbationGrowth> perturbation, at_half_step;  // where the adjoint has grown far
  double rounding = 0;          // what it may have become of state or gradient, in parts of it
  bool is_of_gradient = false;  // it lost its digits before the states did
  double safe_window = 0;       // in which it stays small; of a lost gradient
  bool is_lost() const { return rounding > largest_rounding; }
  /// The equations amplify as much with half the step: it is theirs, and no fault of the scheme. nullopt: not known.
  std::optional<bool> is_of_equations() const;
};
/// Judges a gradient that has been watched. nullopt where too little of it was seen. `beside`: by how much of itself
/// the gradient differs where what it is taken at differs by a rounding; asked for where the adjoint has grown far. It
/// may lose digits before the states do: how fast they grow apart depends on the place. The session's states are others
/// afterwards.
std::optional<GradientGrowth> gradient_growth(driver::Session& session, const std::vector<AdjointWatch::Look>& looks,
                                              const std::function<double()>& beside = {});

}  // namespace dpde::analysis
