// SPDX-License-Identifier: Apache-2.0
// Whether a scene's step is stable, before the scene runs: the largest stable step, the wave or walls that limit it,
// and the growth beyond it.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/coupled_means.h"
#include "stability/step_limit.h"

namespace dpde::stability {

/// The extent of a verdict, and a callback for its progress.
struct Look {
  /// Checks aliasing products on grids of any size, by runs of the tangent: minutes on a million cells. If false, the
  /// check is left out beyond most_cells_folded cells, and the verdict reports that.
  bool at_all_cells = false;
  std::function<void(const std::string& what)> tell = {};
  void says(const std::string& what) const {
    if (tell) tell(what);
  }
};

struct StabilityReport {
  std::string why;  // the reason why it was not analysed; "": it was
  StepLimit limit;
  bool is_exact = false;     // holds for all points, states and times; else an estimate
  bool is_of_grid = false;   // all disturbances of the scene's own grid were checked: see own_grid.h
  bool is_of_walls = false;  // walls lower the limit
  bool is_of_means = false;  // runs lower the limit, as by means that couple all cells: see coupled_means.h
  /// Runs of the step's tangent on the whole grid, whether they lower the limit or not; left out if products alias on
  /// more cells than are checked.
  enum class Runs { none, made, left_out } runs = Runs::none;
  int places = 0;                   // distinct points at which coefficients were frozen
  int places_between_walls = 0;     // of these, the points at which walls were checked
  std::vector<int> solution_cells;  // the coarser grid, if any, on which solutions of solves were found: zero_step.h
  bool is_of_networks = false;      // from a step's tangent on few cells: an estimate, for which no run is refused
  double limiter_step = 0;  // if slopes grow at every step: up to this step limiters only turn slopes into stairs
  double step = 0;          // the scene's step, or the substep into which a Courant number splits it
  int parts = 1;
  double growth = 1;       // |g| in `step` of the wave that most exceeds the growth of the equations
  double beyond = 0;       // ln |g| minus the allowed growth
  double growth_rate = 0;  // largest growth rate of the equations, 1/time
  StateGroup group;        // the states of this verdict, see state_groups.h
  double group_growth_rate = 0, group_growth_by_events = 0;
  std::vector<StabilityReport>
      worse;                    // at most one: of a group with a higher limit that grows more in the scene's step
  double growth_by_events = 0;  // ln of the largest factor of the events that end each step
  std::optional<ShortWaves> short_waves;  // waves that grow in steps of any length
  double end_growth = 0;                  // ln of the growth over the run beyond the allowed growth
  std::string place;                      // the point at which coefficients are frozen; "": all points are alike
  std::string field;                      // the field that grows first
  FrozenPoint worst;                      // the frozen values at `place`
  Angles wave{};
  std::optional<double> courant;  // |v| step/h, summed over the axes, at the limit
  double largest_step = 0;        // largest step up to the limit that divides the run; 0: none

  bool is_analysed() const { return why.empty(); }
  const StabilityReport& dominant() const { return worse.empty() ? *this : worse.front(); }
  bool is_of_runs() const { return runs == Runs::made; }
  bool leaves_out_folding() const { return runs == Runs::left_out; }
  bool is_above() const;
  /// Whether a limiter bounds the growth: it keeps values between those of their neighbours.
  bool is_held_by_limiter() const { return step <= limiter_step; }
  /// The largest step with which a run stays bounded; 0: none, infinite: every step.
  double bounded_step() const;
  /// Whether the step is above the limit and errors grow more than a hundredfold over the run. If a wind is solved for,
  /// the step must exceed 1.5 times the limit, between walls (is_of_walls) twice.
  bool ruins_run() const;
  /// The number of steps in which errors grow a hundredfold; infinite if they do not.
  double hundredfold() const;
};

/// The verdict on the scene. A cached verdict with at_all_cells also answers a query without it.
StabilityReport verdict_of(driver::Session& session, const Look& look = {});

/// True if no disturbance grows in the scene's step; much faster than verdict_of. False means: not known.
bool grows_nothing(driver::Session& session, const Look& look = {});
/// The verdict if grows_nothing is false, else nullopt.
std::optional<StabilityReport> verdict_where_it_grows(driver::Session& session, const Look& look = {});

/// For each of the steps: |g| of the wave that most exceeds the growth of the equations, at the verdict's worst point;
/// of the disturbance between walls if these set the limit.
std::vector<double> growths_at(driver::Session& session, const StabilityReport& verdict,
                               const std::vector<double>& steps);

/// The term of an equation, as written in the source, whose removal raises the largest stable step most. lap(u) counts
/// as one term.
std::optional<SourceRange> limiting_term(const model::Problem& problem, const StabilityReport& verdict);

/// For scenes that are unstable at every step: another time scheme with a stability limit, as "ssp_rk3", and its
/// largest step.
struct OtherScheme {
  std::string time;
  double step;
};
std::optional<OtherScheme> stable_scheme(driver::Session& session);

/// How the narrow cells around a pole affect the limit, and a remedy; "": they do not.
std::string pole_text(const model::Problem& problem, const StabilityReport& verdict);

/// Text on waves of a few cells that grow in steps of any length; "": there are none.
std::string short_waves_text(const StabilityReport& verdict);

/// "the wave of 2 cells along x and of 8 along y", "what walls do".
std::string wave_text(const StabilityReport& verdict, const model::Problem& problem);

/// The verdict as advice after a run blew up; "" if the verdict does not explain it.
std::string advice_on_blow_up(driver::Session& session);

/// Reports a step that is too large: as an error if it ruins the run, else as a warning. `force`: no check is made.
/// Returns false after an error.
bool check_step(driver::Session& session, bool force, DiagnosticSink& sink, const Look& look = {});
/// The same check for scenes that generate data, for SessionOptions::judge.
std::function<bool(driver::Session& session, DiagnosticSink& sink)> judge_of_steps(bool force);

}  // namespace dpde::stability
