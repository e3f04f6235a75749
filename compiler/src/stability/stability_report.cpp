// SPDX-License-Identifier: Apache-2.0
#include "stability/stability_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "dpde/runtime/error.h"
#include "model/boundary/metric.h"
#include "stability/equations.h"
#include "stability/examination.h"
#include "stability/frozen/consistent_start.h"
#include "stability/frozen/zero_step.h"
#include "stability/report/local_character.h"
#include "stability/report/verdict_cache.h"
#include "stability/step/folded_products.h"
#include "stability/step/own_grid.h"
#include "stability/step/whole_fields.h"
#include "stability/waves/courant_number.h"
#include "stability/waves/wall_spectrum.h"

namespace dpde::stability {

namespace {

constexpr double hundred = 4.605170185988092;  // ln 100
constexpr double no_limit = std::numeric_limits<double>::infinity();

/// The largest step up to the limit that divides the length of the run.
double whole_step(const model::Problem& problem, double limit) {
  const double length = problem.steps * problem.step;
  if (!(limit > 0) || !(length > 0)) return 0;
  const double steps = std::ceil(length / limit * (1 - 1e-12));
  return length / std::max(1.0, steps);
}

StabilityReport verdict_on_networks(driver::Session& session, const StateGroup& group, double most, std::string why) {
  StabilityReport verdict;
  verdict.why = std::move(why);
  verdict.group = group;
  examine_networks(session, group, most, verdict);
  if (verdict.limit.kind == StepLimit::Kind::limit)
    verdict.largest_step = whole_step(session.problem(), verdict.limit.step);
  return verdict;
}

/// A group and its linear step, or the reason why it has none, as with networks.
struct GroupStep {
  StateGroup group;
  std::string why = {};
  std::optional<LinearStep> linear = {};
};

/// The steps of all groups; those with a network come last, as they take long.
std::vector<GroupStep> steps_of_groups(driver::Session& session) {
  std::vector<GroupStep> steps;
  for (StateGroup& group : state_groups(session)) {
    steps.push_back({std::move(group)});
    steps.back().linear = linear_step(session, steps.back().why, steps.back().group);
  }
  std::ranges::stable_partition(steps, [](const GroupStep& step) { return step.linear.has_value(); });
  return steps;
}

/// The verdict on one group. With networks, which take long, no limit above `most` is searched for.
StabilityReport verdict_on(driver::Session& session, const GroupStep& step, double most, const Look& look) {
  const auto& [group, why, linear] = step;
  if (!linear) return verdict_on_networks(session, group, most, why);
  StabilityReport verdict;
  verdict.group = group;
  bool is_finite = false;
  try {
    is_finite = examine_group(session, *linear, look, verdict);
  } catch (const NoSolution& error) {
    verdict = {};
    verdict.group = group;
    verdict.why = fmt::format("a step finds no solution ({})", error.what());
    return verdict;
  }
  if (!is_finite) {
    verdict.why = linear->solves() ? "what the step solves for is not known at the initial state"
                                   : "the step's tangent is not finite at the initial state";
    return verdict;
  }
  const model::Problem& problem = session.problem();
  const model::Scheme& scheme = problem.scheme;
  if (verdict.limit.kind == StepLimit::Kind::never && scheme.has_limiter() && model::is_euler(scheme.time))
    verdict.limiter_step = stability::positivity_of(session, verdict.step, group).largest_step;
  verdict.end_growth = verdict.beyond * session.steps() * verdict.parts;
  verdict.group_growth_rate = verdict.growth_rate;
  verdict.group_growth_by_events = verdict.growth_by_events;
  if (verdict.limit.kind != StepLimit::Kind::limit) return verdict;
  verdict.courant = courant_number(problem, verdict.worst, verdict.limit.step, group);
  if (verdict.parts == 1) verdict.largest_step = whole_step(problem, verdict.limit.step);
  return verdict;
}

/// The verdict on both: that with the lower limit, and in `worse` the group that grows most in the scene's step.
StabilityReport merged(const StabilityReport& a, const StabilityReport& b) {
  const bool is_first = a.limit.largest() <= b.limit.largest();
  StabilityReport lower = is_first ? a : b;
  const StabilityReport& other = is_first ? b : a;
  lower.is_exact = lower.is_exact && other.is_exact;
  lower.places = std::max(lower.places, other.places);
  lower.growth_rate = std::max(lower.growth_rate, other.growth_rate);
  if (other.leaves_out_folding()) lower.runs = other.runs;
  lower.growth_by_events = std::max(lower.growth_by_events, other.growth_by_events);
  if (other.short_waves && (!lower.short_waves || other.short_waves->rate > lower.short_waves->rate))
    lower.short_waves = other.short_waves;
  StabilityReport most = lower.dominant(), candidate = other.dominant();
  if (candidate.is_above() && (!most.is_above() || candidate.end_growth > most.end_growth)) {
    candidate.worse.clear();
    lower.worse = {std::move(candidate)};
  }
  return lower;
}

}  // namespace

bool look_for_growth(driver::Session& session, const Look& look) try {
  const ConsistentStart start(session);
  return std::ranges::all_of(steps_of_groups(session), [&](const GroupStep& step) {
    return step.linear ? grows_nothing_in(session, *step.linear, look) : networks_grow_nothing(session, step.group);
  });
} catch (const NoSolution&) {
  return false;  // the verdict reports it
}

bool StabilityReport::is_above() const {
  if (!is_analysed() || limit.kind == StepLimit::Kind::none) return false;
  if (limit.kind == StepLimit::Kind::never) return beyond > 1e-9;
  return step > limit.step * (is_of_networks ? 1 + 2e-2 : is_of_walls || is_of_grid ? 1 + 2e-3 : 1 + 1e-4);
}

/// A wind that is solved for is often fast only in a narrow spot, which waves leave before they have grown: runs of
/// vortices stay bounded up to 1.4 times the limit. Between walls the frozen values fill the whole domain, although
/// they differ near the walls: runs were bounded up to 1.6 times the limit.
bool StabilityReport::ruins_run() const {
  const bool has_wind =
      std::ranges::any_of(worst.whole, [](const auto& entry) { return entry.second.slope != std::array<double, 3>{}; });
  const double sure = is_of_walls && !is_of_grid ? 2 : has_wind ? 1.5 : 1;
  const bool is_sure = limit.kind != StepLimit::Kind::limit || step > sure * limit.step;
  if (!worse.empty() && worse.front().ruins_run()) return true;
  return is_above() && is_sure && end_growth > hundred && !is_held_by_limiter() && !is_of_networks;
}

double StabilityReport::bounded_step() const {
  if (!is_analysed() || limit.kind == StepLimit::Kind::none) return std::numeric_limits<double>::infinity();
  return limit.kind == StepLimit::Kind::limit ? limit.step : limiter_step;
}

double StabilityReport::hundredfold() const {
  return is_above() && beyond > 0 ? hundred / (beyond * parts) : std::numeric_limits<double>::infinity();
}

StabilityReport examine(driver::Session& session, const Look& look) {
  StabilityReport verdict;
  if (session.problem().substeps.control) {
    verdict.why = "steps adapt to the tolerance, and no step is judged before it is made";
    return verdict;
  }
  const ConsistentStart start(session);
  std::optional<StabilityReport> all, unknown;
  for (const GroupStep& step : steps_of_groups(session)) {
    const StabilityReport found = verdict_on(session, step, all ? all->limit.largest() : no_limit, look);
    if (!found.is_analysed())
      unknown = found;
    else
      all = all ? merged(*all, found) : found;
  }
  verdict = unknown && !(all && all->is_above()) ? *unknown : *all;
  const bool is_any_found = has_whole_fields(session) || !session.problem().projections.empty();
  const CoarseGrid grid = grid_of_solutions(session);
  if (is_any_found && !grid.is_own()) verdict.solution_cells = grid.cells();
  return verdict;
}

std::vector<double> growths_at(driver::Session& session, const StabilityReport& verdict,
                               const std::vector<double>& steps) {
  std::vector<double> growths(steps.size(), std::numeric_limits<double>::quiet_NaN());
  std::string why;
  const std::optional<LinearStep> linear = linear_step(session, why, verdict.group);
  if (!linear || !verdict.is_analysed()) return growths;
  const ConsistentStart start(session);
  const Equations equations(session.problem(), linear->group());
  if (verdict.is_of_grid) {
    const auto grid = OwnGrid::make(session, *linear, verdict.worst, verdict.step, equations);
    for (std::size_t i = 0; grid && i < steps.size(); ++i) growths[i] = grid->growth(steps[i]);
    return growths;
  }
  const int rank = static_cast<int>(session.axes().size());
  const auto analysis = FrozenAnalysis::make(*linear, verdict.worst, rank, verdict.step, &equations);
  const WallSpectrum walls(*linear, session.axes());
  for (std::size_t i = 0; analysis && i < steps.size(); ++i) {
    growths[i] = analysis->growth_of(analysis->excess(steps[i]).angles, steps[i]);
    if (!verdict.is_of_walls) continue;
    for (const std::complex<double> g : walls.eigenvalues(verdict.worst, steps[i]))
      growths[i] = std::max(growths[i], std::abs(g));
  }
  return growths;
}

std::string wave_text(const StabilityReport& verdict, const model::Problem& problem) {
  if (verdict.is_of_networks) return "a disturbance";
  if (verdict.is_of_walls) return "what walls do";
  if (verdict.is_of_means && problem.metric) return "what the cells of the whole grid do";
  if (verdict.is_of_means)
    return folds_products(problem, verdict.group) ? "what products fold back" : "what means tie together";
  std::vector<std::string> parts;
  double last = 0;
  for (std::size_t a = 0; a < problem.axes.size(); ++a) {
    const double angle = std::abs(std::remainder(verdict.wave[a], 2 * std::numbers::pi));
    if (angle < 1e-4) continue;
    const bool is_same = std::abs(angle - last) < 1e-3;
    const double length = 2 * std::numbers::pi / angle;
    const std::string name = model::name_of_axis(problem, a);
    parts.push_back(is_same                              ? name
                    : length > 2 * problem.axes[a].cells ? "longer than the grid along " + name
                                                         : fmt::format("of {:.3g} cells along {}", length, name));
    last = angle;
  }
  const bool is_one_cell = std::ranges::all_of(problem.axes, [](const model::Axis& axis) { return axis.cells == 1; });
  if (parts.empty()) return is_one_cell ? "a disturbance" : "the mean of all cells";
  return fmt::format("the wave {}", fmt::join(parts, " and "));
}

}  // namespace dpde::stability
