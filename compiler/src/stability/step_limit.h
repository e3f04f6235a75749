// SPDX-License-Identifier: Apache-2.0
// The largest stable step at a frozen point: the one up to which no wave grows faster than the equations let it.
//
// A wave of angles a grows by |g| = the spectral radius of G(a) in a step. The equations, as they are discretised in
// space, let it grow by exp(s dt), s being the largest real part of the eigenvalues of dG/d(dt) at dt = 0, at most that
// of waves of eight cells and more (is_resolved), or what the equations do to some wave without a grid (Symbol). The
// step is stable where
//   ln |g| <= r dt  for all a,  r = 2 max(s(a), 0) :
// von Neumann's condition |g| <= 1 + O(dt), with a factor 2 for what a scheme may err in growth that is real. Waves
// that are resolved, and those of Fourier series that do not decay, have r = max(s) at least: errors that grow no
// faster than the solution are none. Where something grows by right, no more of a wave's factors may be above 1 than it
// has rates that do not decay. All states of the step count as one: those that do not depend on one another are judged
// apart (see state_groups.h). Events that end each step may multiply a wave besides by what they do in a step of length
// 0.
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
    none,   // no step was found that is too large
    never   // waves grow at every step, by an amount of the order dt^order a step
  } kind = Kind::none;
  double step = 0;
  double order = 0;
  Angles wave{};          // that grows first beyond the limit, or most at the step that was asked for
  std::size_t state = 0;  // the largest share of it
  /// Growth at each step, but so little (an order of 4 and more) that short runs look stable.
  bool is_weak() const { return kind == Kind::never && order > 3.5; }
};

/// What is allowed to remain of ln |g|: rounding, the root of it where eigenvalues are one.
double growth_tolerance(const LinearStep& linear);

/// How much a step does at a frozen point: ln |g| of the wave that grows most, and the largest |g - 1| of all.
struct StepGrowth {
  double growth = 0, change = 0;
};
/// nullopt where the step's tangent is not finite, or the flow goes too far to be followed.
std::optional<StepGrowth> growth_in_step(const LinearStep& linear, const FrozenPoint& point, int rank, double step);

class FrozenAnalysis {
 public:
  /// `step` sets the scale of steps that are tried. nullopt where values are not finite. Without `equations` no short
  /// wave may grow more than those that are resolved.
  static std::optional<FrozenAnalysis> make(const LinearStep& linear, const FrozenPoint& point, int rank, double step,
                                            const Equations* equations = nullptr);

  /// The largest real part of the equations' eigenvalues, 1/time: of all waves, and of one as the differences have it.
  double growth_rate() const { return growth_; }
  double growth_rate_of(const Angles& wave) const;
  /// ln |g| of what the events that end each step let grow most; 0 where they let nothing grow.
  double growth_by_events() const;
  /// ln |g| beyond what the equations may do, of the wave where that is largest; infinite where it is not finite.
  Largest excess(double step) const;
  /// The wave as this step has it: its factors as excess() takes them, the largest |g|, and the state with the largest
  /// share. Not where the step goes too far to be followed: no factors, and an infinite |g|.
  Eigen::VectorXcd factors(const Angles& wave, double step) const;
  double growth_of(const Angles& wave, double step) const;
  std::size_t largest_share(const Angles& wave, double step) const;

  bool is_stable(double step) const;
  /// Whether the factors of this step are a function of rates: then no wave needs eigenvalues of its own.
  bool is_of_rates(double step) const;
  /// Whose rates are known. Steps of any length that are functions of them look at no others but the neighbours of
  /// what grows most.
  std::size_t waves_known() const { return own_eigenvalues_.size(); }

  /// None is looked for above `most`; relative `precision`.
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
  /// nullopt where the step goes too far to be followed.
  std::optional<Factors> factors_of(double step) const;
  StepLimit bisect(double stable, double unstable, double precision) const;
  StepLimit descend(double unstable, double precision) const;
  StepLimit limit_of_any_step() const;
  double next_step(double step) const;
  Largest find_excess(double step) const;

  const LinearStep *linear_, *plain_;  // the second without events: it has the rates of the equations
  FrozenPoint point_;
  mutable FrozenStages stages_, plain_stages_;  // of the point: caches
  int rank_;
  double rate_ = 0, growth_ = 0, longest_ = 0;
  bool are_all_resolved_ = false;            // Fourier series have all waves as they are
  std::optional<Amplification> rates_;       // dG/d(dt) where G is smooth about dt = 0 and 1 there
  std::optional<Amplification> short_step_;  // else G of a step that is short for all waves, `short_`
  double short_ = 0;
  StepOfRates step_of_rates_;                    // what most steps are of the rates, where that is known
  std::vector<StepOfRates::Place> places_ = {};  // rows of the step in it
  mutable std::set<double> of_rates_;            // steps that were found to be so, until it is known of all
  mutable std::map<Angles, Eigen::VectorXcd> own_eigenvalues_;  // of these: a cache
  mutable std::map<double, Largest> excess_;                    // by steps: searches come back to them, a cache
  std::optional<Amplification> events_;                         // G of a step of length 0
};

}  // namespace dpde::stability
