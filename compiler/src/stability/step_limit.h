// SPDX-License-Identifier: Apache-2.0
// The largest stable step at a frozen point: up to it no Fourier mode grows faster than the equations allow.
//
// In a step a wave of angles a grows by |g|, the spectral radius of G(a). The equations, discretised in space, make it
// grow by exp(s dt), where s is the largest real part of the eigenvalues of dG/d(dt) at dt = 0. s is bounded by that of
// waves of eight cells and more (is_resolved), or by that of some wave in the equations without a grid (Symbol). The
// step is stable if
//   ln |g| <= r dt  for all a,  r = 2 max(s(a), 0) :
// von Neumann's condition |g| <= 1 + O(dt). The factor 2 is for the errors of a scheme in physical growth. Waves that
// are resolved, and those of Fourier series that do not decay, have r >= max(s): errors that grow no faster than the
// solution do no harm. If the equations have growing solutions, a wave may have no more factors above 1 than it has
// rates that do not decay. All states of the step are taken together; states that do not depend on one another have
// verdicts of their own (state_groups.h). Events that end each step may also multiply a wave by their factor in a step
// of length 0.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "stability/allowed_growth.h"
#include "stability/equations.h"
#include "stability/waves/amplification.h"

namespace dpde::stability {

struct StepLimit {
  enum class Kind {
    limit,  // stable up to `step`
    none,   // no unstable step was found
    never   // waves grow at every step, by an amount of the order dt^order a step
  } kind = Kind::none;
  double step = 0;
  double order = 0;
  Angles wave{};          // the wave that grows first beyond the limit, or most in the queried step
  std::size_t state = 0;  // the state with the largest component in that wave
  /// The largest stable step: infinite if no unstable step was found.
  double largest() const { return kind == Kind::none ? std::numeric_limits<double>::infinity() : step; }
  /// Growth at each step, but so weak (order of about 4 and more) that short runs look stable.
  bool is_weak() const { return kind == Kind::never && order > 3.5; }
};

/// The tolerance of ln |g|: rounding, or its square or cube root, as multiple eigenvalues are computed less exactly.
double growth_tolerance(const LinearStep& linear);

/// The effect of a step at a frozen point: ln |g| of the wave that grows most, and the largest |g - 1| of all waves.
struct StepGrowth {
  double growth = 0, change = 0;
};
/// nullopt if the step's tangent is not finite, or the flow carries too far in a step.
std::optional<StepGrowth> growth_in_step(const LinearStep& linear, const FrozenPoint& point, int rank, double step);

class FrozenAnalysis {
 public:
  /// `step` sets the scale of the steps that are tried. nullopt if values are not finite. Without `equations` no short
  /// wave may grow faster than the resolved waves.
  static std::optional<FrozenAnalysis> make(const LinearStep& linear, const FrozenPoint& point, int rank, double step,
                                            const Equations* equations = nullptr);

  /// The largest real part of the equations' eigenvalues, 1/time: of all waves, and of one wave by the differences.
  double growth_rate() const { return growth_; }
  double growth_rate_of(const Angles& wave) const;
  /// The largest ln |g| over all waves of the events that end each step; 0 if none grows by them.
  double growth_by_events() const;
  /// The largest ln |g| minus the allowed growth over all waves, and that wave; infinite if values are not finite.
  Largest excess(double step) const;
  /// For one wave in this step: the factors that excess() uses, the largest |g|, and the state with the largest
  /// component. If the flow carries too far in the step: no factors, and an infinite |g|.
  Eigen::VectorXcd factors(const Angles& wave, double step) const;
  double growth_of(const Angles& wave, double step) const;
  std::size_t largest_share(const Angles& wave, double step) const;

  bool is_stable(double step) const;
  /// Whether the factors of this step are a function of the eigenvalues of L: no wave then needs those of this step.
  bool is_of_rates(double step) const;
  /// The number of waves whose eigenvalues of L are cached. Steps of any length that are functions of L add only the
  /// neighbours of the fastest growing wave.
  std::size_t waves_known() const { return own_eigenvalues_.size(); }

  /// Searches no limit above `most`; `precision` is relative.
  StepLimit limit(double most = std::numeric_limits<double>::infinity(), double precision = 5e-5) const;

 private:
  FrozenAnalysis(const LinearStep& linear, const LinearStep* without_events, FrozenPoint point, int rank)
      : linear_(&linear),
        plain_(without_events == nullptr ? &linear : without_events),
        point_(std::move(point)),
        rank_(rank) {}
  std::optional<Amplification> at(double step) const;
  std::optional<LinearisedStep> plain_response(double step) const;
  bool measure_rates(double step);
  void measure_growth(const Equations* equations);
  bool is_growth_of_steps() const;
  double growth_on_ring() const;
  double allowed_rate(const Angles& wave) const;
  double allowed_to_events(const Angles& wave) const;
  AllowedGrowth allowed() const { return {growth_, are_all_resolved_}; }
  double rate_of_decay() const;
  double growth_of_decaying(const Eigen::VectorXcd& factors, const Angles& wave) const;
  const Eigen::VectorXcd& own_eigenvalues(const Angles& wave) const;
  Largest over_waves(const std::function<double(const Angles&)>& f) const;
  bool estimate(double step);
  bool differentiate(double step);
  bool take_rates_of(const Equations& equations);
  bool is_made_of_rates(const Amplification& g, double step) const;
  bool is_known_to_be_of_rates() const;
  using Factors = std::function<Eigen::VectorXcd(const Angles&)>;
  /// nullopt if the flow carries too far in the step.
  std::optional<Factors> factors_of(double step) const;
  StepLimit bisect(double stable, double unstable, double precision) const;
  StepLimit descend(double unstable, double precision) const;
  StepLimit limit_of_any_step() const;
  double next_step(double step) const;
  Largest find_excess(double step) const;

  const LinearStep *linear_, *plain_;  // plain_: without events, for the rates of the equations
  FrozenPoint point_;
  mutable FrozenStages stages_, plain_stages_;  // of the point: caches
  int rank_;
  double rate_ = 0, growth_ = 0, longest_ = 0;
  bool are_all_resolved_ = false;            // Fourier series represent every wave exactly
  std::optional<Amplification> rates_;       // dG/d(dt) where G is smooth about dt = 0 and 1 there
  std::optional<Amplification> short_step_;  // else G of a step that is short for all waves, `short_`
  double short_ = 0;
  StepOfRates step_of_rates_;                                   // the step as a function of L, if known
  std::vector<StepOfRates::Place> places_ = {};                 // the step's rows in it
  mutable std::set<double> of_rates_;                           // steps found to be that function
  mutable std::map<Angles, Eigen::VectorXcd> own_eigenvalues_;  // of rates_ or short_step_: a cache
  mutable std::map<double, Largest> excess_;                    // by step: a cache, as searches return to steps
  std::optional<Amplification> events_;                         // G of a step of length 0
};

}  // namespace dpde::stability
