// SPDX-License-Identifier: Apache-2.0
// Whether a scene's step is stable, before it is made: the largest step that is, what limits it, and what happens
// beyond.
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

/// How far a verdict goes, and who hears what is done meanwhile.
struct Look {
  /// At products that fold back on grids of any size: a look by runs, which takes minutes on a million cells. Else
  /// beyond most_cells_folded it is left out, and the verdict says so.
  bool at_all_cells = false;
  std::function<void(const std::string& what)> tell = {};
  void says(const std::string& what) const {
    if (tell) tell(what);
  }
};

struct StabilityReport {
  std::string why;  // not analysed, and why; "" where it is
  StepLimit limit;
  bool is_exact = false;     // holds for all places, states and times; else an estimate
  bool is_of_grid = false;   // all disturbances of the scene's own grid were looked at: see own_grid.h
  bool is_of_walls = false;  // it is walls that lower the limit
  bool is_of_means = false;  // or means of fields, which tie all cells to one another: see coupled_means.h
  /// Of the step's tangent on all of the grid, whether they lower the limit or not; left out where products fold back
  /// on more cells than are looked at.
  enum class Runs { none, made, left_out } runs = Runs::none;
  int places = 0;                   // at which coefficients were frozen, none of them like another
  int places_between_walls = 0;     // of these, those at which walls were looked at
  std::vector<int> solution_cells;  // fewer than the scene's, on which what steps solve for was found: zero_step.h
  bool is_of_networks = false;      // by a step's tangent on few cells: an estimate, and no run is refused for it
  double limiter_step = 0;  // where slopes grow at each step: up to this one limiters make stairs of them, and no more
  double step = 0;          // the scene's, or that of the parts into which a Courant number splits it
  int parts = 1;
  double growth = 1;       // |g| in such a step, of the wave that grows most beyond what the equations do
  double beyond = 0;       // ln |g| less what the equations may do
  double growth_rate = 0;  // largest of the equations' own, 1/time
  StateGroup group;        // that it is of, see state_groups.h
  double group_growth_rate = 0, group_growth_by_events = 0;
  std::vector<StabilityReport>
      worse;                    // at most one: of a group with a higher limit that grows more in the scene's step
  double growth_by_events = 0;  // ln of what those that end each step multiply at most
  std::optional<ShortWaves> short_waves;  // that grow however short steps are
  double end_growth = 0;                  // ln of the growth beyond the equations' over the run
  std::string place;                      // where coefficients are frozen; "" where all places are alike
  std::string field;                      // that grows first
  FrozenPoint worst;                      // that place, as it is frozen
  Angles wave{};
  std::optional<double> courant;  // |v| step/h, summed over the axes, at the limit
  double largest_step = 0;        // at most the limit, and the run is a whole number of it; 0 where there is none

  bool is_analysed() const { return why.empty(); }
  const StabilityReport& dominant() const { return worse.empty() ? *this : worse.front(); }
  bool is_of_runs() const { return runs == Runs::made; }
  bool leaves_out_folding() const { return runs == Runs::left_out; }
  bool is_above() const;
  /// Growth ends where a limiter keeps values between their neighbours'.
  bool is_held_by_limiter() const { return step <= limiter_step; }
  /// Up to which a run is bounded; 0: none, infinite: all are.
  double bounded_step() const;
  /// Beyond the limit by so much that the run's errors grow a hundredfold; where a wind is solved for, also by half.
  bool ruins_run() const;
  /// Steps in which errors grow a hundredfold; infinite where they do not.
  double hundredfold() const;
};

/// Of what is kept by a verdict that looks at all cells, too.
StabilityReport verdict_of(driver::Session& session, const Look& look = {});

/// Whether nothing grows in the scene's step: much quicker than a verdict, which says no more then than that all is
/// well. False where something may.
bool grows_nothing(driver::Session& session, const Look& look = {});
/// The verdict where that is false.
std::optional<StabilityReport> verdict_where_it_grows(driver::Session& session, const Look& look = {});

/// |g| of the wave that grows most beyond what the equations do, at each of the steps, where the verdict is worst; of
/// what walls do where they limit.
std::vector<double> growths_at(driver::Session& session, const StabilityReport& verdict,
                               const std::vector<double>& steps);

/// The term of an equation, as a person wrote it, without which the largest stable step is largest: lap(u) is one term.
std::optional<SourceRange> limiting_term(const model::Problem& problem, const StabilityReport& verdict);

/// Another time scheme that has a limit, and its largest step, for scenes without one: "ssp_rk3".
struct OtherScheme {
  std::string time;
  double step;
};
std::optional<OtherScheme> stable_scheme(driver::Session& session);

/// What the narrow cells around a pole have to do with the limit, and what helps; "": nothing.
std::string pole_text(const model::Problem& problem, const StabilityReport& verdict);

/// Of waves of a few cells that grow however short steps are; "": of none.
std::string short_waves_text(const StabilityReport& verdict);

/// "the wave of 2 cells along x and of 8 along y", "what walls do".
std::string wave_text(const StabilityReport& verdict, const model::Problem& problem);

/// The verdict for who asks why a run blew up; "" where it says nothing.
std::string advice_on_blow_up(driver::Session& session);

/// Reports a step that is too large: an error where it ruins the run, else a warning. `force`: nobody looks. False
/// after an error.
bool check_step(driver::Session& session, bool force, DiagnosticSink& sink, const Look& look = {});
/// The same of scenes that make data, for SessionOptions::judge.
std::function<bool(driver::Session& session, DiagnosticSink& sink)> judge_of_steps(bool force);

}  // namespace dpde::stability
