// SPDX-License-Identifier: Apache-2.0
#include "stability/examination.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "stability/equations.h"
#include "stability/frozen/consistent_start.h"
#include "stability/frozen/frozen_points.h"
#include "stability/step/coupled_means.h"
#include "stability/step/folded_products.h"
#include "stability/step/own_grid.h"
#include "stability/step/own_grid_limit.h"
#include "stability/step/step_search.h"
#include "stability/step/wall_rates.h"
#include "stability/substeps.h"

namespace dpde::stability {

namespace {

constexpr double told_growth = 0.1;      // ln of the growth over a run that is not reported
constexpr double wall_tolerance = 1e-6;  // ln |g| of a dense matrix
constexpr std::size_t most_places_between_walls = 5;
constexpr double precision_of_runs = 1e-3;       // of a limit
constexpr double precision_of_guess = 2.5e-4;    // of a limit
constexpr double precision_with_folding = 2e-2;  // of a limit, which falls as waves spread
constexpr double safely = 0.9;                   // of a limit: a step well below it

bool has_walls(const model::Problem& problem) {
  return std::ranges::any_of(problem.axes, [](const model::Axis& a) { return a.topology == Topology::bounded; });
}

/// Whether walls can be modelled with frozen coefficients. In curved coordinates they cannot, see coupled_means.h.
bool are_walls_alike(const model::Problem& problem) { return has_walls(problem) && !problem.metric; }

/// The smallest limit over all frozen points, and the largest growth at the scene's step.
class Examination {
 public:
  /// `problem` is the session's, or the same with another scheme.
  Examination(driver::Session& session, const model::Problem& problem, const LinearStep& linear, const Look& look,
              StabilityReport& verdict)
      : session_(session),
        problem_(problem),
        look_(look),
        linear_(with_means_of_runs(session, linear, session.problem().step)),
        verdict_(verdict),
        rank_(static_cast<int>(session.axes().size())),
        equations_(problem, linear.group()),
        walls_(linear_, equations_.without_events(), session.axes()) {
    verdict_.parts = parts_of(session);
    verdict_.step = session.problem().step / verdict_.parts;
  }

  bool run() {
    const auto [points, others] = ranked_points(session_, linear_);
    verdict_.places = static_cast<int>(points.size() + others.size());
    for (const ScenePoint& point : points) look_at(point);
    for (const ScenePoint& point : others) {
      if (may_be_worse(point)) look_at(point);
    }
    if (!is_any_) return false;
    verdict_.is_exact =
        !has_walls(problem_) && is_same_everywhere(session_, linear_, worst_.point) && !linear_.is_semi_lagrangian();
    if (verdict_.is_exact) return true;
    if (const std::vector<OwnGrid> grids = own_grids(points); !grids.empty()) {
      look_at_own(grids);
      return true;
    }
    if (const auto runs = do_runs_decide() ? runs_about(worst_.point) : nullptr) {
      decide_by_runs(*runs);
      return true;
    }
    const std::vector<FrozenPoint> moments = moments_of_means(points);
    if (const auto runs = coupled_runs(moments.front())) {
      if (runs->tells_eigenvalues() && may_be_artefact_of_curvature()) leave_to_runs();
      look_at_runs(*runs);
      for (std::size_t i = 1; i < moments.size(); ++i) look_at_runs(*coupled_runs(moments[i]));
      return true;
    }
    if (!are_walls_alike(problem_)) return true;
    for (const ScenePoint& point : worst_first(places_between_walls(points))) {
      if (verdict_.limit.kind == StepLimit::Kind::never) break;
      ++verdict_.places_between_walls;
      look_at_walls(point);
    }
    return true;
  }

  /// Whether no disturbance grows in the scene's step, neither a Fourier mode nor one between walls. It searches for no
  /// largest step and needs the equations only where a mode grows. Most scenes need no more than this check.
  bool grows_nothing() {
    double most = -1;
    auto [points, others] = ranked_points(session_, linear_);
    points.insert(points.end(), others.begin(), others.end());
    worst_ = points.front();
    const bool is_same = is_same_everywhere(session_, linear_, worst_.point) && !linear_.is_semi_lagrangian();
    const bool are_waves_all = is_same && !has_walls(problem_);
    if (const auto grids = are_waves_all ? std::vector<OwnGrid>() : own_grids(points); !grids.empty())
      return std::ranges::all_of(
          grids, [&](const OwnGrid& grid) { return grid.is_stable(verdict_.step) && !grows_weakly(grid); });
    for (const ScenePoint& point : points) {
      const auto found = growth_in_step(linear_, point.point, rank_, verdict_.step);
      if (!found || (grows(found->growth) && grows_beyond_equations(point))) return false;
      if (found->change > most) most = found->change, worst_ = point;
    }
    if (most < 0) return false;
    const std::vector<FrozenPoint> moments = moments_of_means(points);
    if (const auto runs = coupled_runs(moments.front())) {
      return runs->is_stable(verdict_.step) && std::all_of(moments.begin() + 1, moments.end(), [&](const auto& moment) {
               return coupled_runs(moment)->is_stable(verdict_.step);
             });
    }
    if (!are_walls_alike(problem_)) return true;
    return std::ranges::all_of(places_between_walls(points), [&](const ScenePoint& point) {
      const double rate = walls_.rate(point, verdict_.step) - 2 * verdict_.growth_rate;
      return rate * verdict_.step - walls_.growth_by_events(point) <= wall_tolerance;
    });
  }

 private:
  std::optional<FrozenAnalysis> analysis_at(const FrozenPoint& point) const {
    return FrozenAnalysis::make(linear_, point, rank_, verdict_.step, &equations_);
  }
  /// More than rounding, or enough over the run to be reported.
  bool grows(double in_step) const {
    return in_step > growth_tolerance(linear_) || in_step * session_.steps() * verdict_.parts > told_growth;
  }
  bool grows_beyond_equations(const ScenePoint& point) {
    const auto analysis = analysis_at(point.point);
    if (!analysis || grows(analysis->excess(verdict_.step).value)) return true;
    verdict_.growth_rate = std::max(verdict_.growth_rate, analysis->growth_rate());
    return false;
  }

  /// The limit at a point. A frozen slope may make long waves grow for ever, although the flow carries them past it. So
  /// a limit by long waves, or none at all, is computed again with slopes 0. Not with limiters: these make another
  /// scheme at a slope.
  StepLimit limit_at(const FrozenAnalysis& analysis, const ScenePoint& point) const {
    // Limits above the smallest known one are of no use.
    const double most =
        verdict_.limit.kind == StepLimit::Kind::limit ? verdict_.limit.step : std::numeric_limits<double>::infinity();
    const StepLimit limit = analysis.limit(most);
    const bool is_long = limit.kind != StepLimit::Kind::none && is_resolved(limit.wave);
    if ((limit.kind != StepLimit::Kind::never && !is_long) || problem_.scheme.has_limiter()) return limit;
    FrozenPoint without_slopes = flat(point.point);
    without_slopes.are_coordinates_flat = do_runs_decide();
    const bool is_other = without_slopes.fields != point.point.fields || without_slopes.are_coordinates_flat;
    const auto without = is_other ? analysis_at(without_slopes) : std::nullopt;
    return without ? without->limit(most) : limit;
  }

  /// Whether some wave grows at the point in the largest step that is stable at the points analysed so far.
  bool may_be_worse(const ScenePoint& point) const {
    if (verdict_.limit.kind == StepLimit::Kind::never) return false;
    const bool has_limit = verdict_.limit.kind == StepLimit::Kind::limit;
    const double step = has_limit ? verdict_.limit.step : verdict_.step;
    const std::optional<StepGrowth> found = growth_in_step(linear_, point.point, rank_, step);
    return found && found->growth > growth_tolerance(linear_);
  }

  void look_at(const ScenePoint& point) {
    look_.says("steps of all lengths: waves" + (point.place.empty() ? "" : " at " + point.place));
    if (const std::optional<FrozenAnalysis> analysis = analysis_at(point.point)) look_at(*analysis, point);
  }
  void look_at(const FrozenAnalysis& analysis, const ScenePoint& point) {
    verdict_.growth_rate = std::max(verdict_.growth_rate, analysis.growth_rate());
    verdict_.growth_by_events = std::max(verdict_.growth_by_events, analysis.growth_by_events());
    if (!is_any_ || linear_.is_semi_lagrangian() || verdict_.limit.kind == StepLimit::Kind::none ||
        analysis.excess(verdict_.limit.kind == StepLimit::Kind::limit ? verdict_.limit.step : verdict_.step).value >
            1e-9) {
      const StepLimit limit = limit_at(analysis, point);
      if (!is_any_ || limit.largest() < verdict_.limit.largest()) take(limit, point);
    }
    const Largest now = analysis.excess(verdict_.step);
    if (!is_any_ || now.value > verdict_.beyond) {
      verdict_.beyond = now.value;
      verdict_.growth = analysis.growth_of(now.angles, verdict_.step);
      if (verdict_.limit.kind == StepLimit::Kind::never) verdict_.wave = now.angles;
    }
    is_any_ = true;
  }

  /// The points at which walls are checked: the worst for waves, and those where a field of the response is smallest
  /// or largest (inflow at one point is outflow at another). In 3D, at a second a point, only the worst.
  std::vector<ScenePoint> places_between_walls(const std::vector<ScenePoint>& points) const {
    std::vector<ScenePoint> places{worst_};
    const auto add = [&](const ScenePoint& point) {
      const auto is_it = [&](const ScenePoint& other) { return other.place == point.place; };
      if (places.size() < most_places_between_walls && std::ranges::none_of(places, is_it)) places.push_back(point);
    };
    if (rank_ == 3) return places;
    for (const std::string& name : fields_of_response(linear_, worst_.point, verdict_.step)) {
      const auto is_finite = [&](const ScenePoint& p) { return std::isfinite(p.point.fields.at(name).value); };
      if (!std::ranges::all_of(points, is_finite)) continue;
      const auto value_at = [&](const ScenePoint& p) { return p.point.fields.at(name).value; };
      const auto [low, high] = std::ranges::minmax_element(points, {}, value_at);
      add(*low);
      add(*high);
    }
    return places;
  }

  void take(const StepLimit& limit, const ScenePoint& point) {
    verdict_.limit = limit;
    verdict_.place = point.place;
    verdict_.wave = limit.wave;
    verdict_.field = linear_.states()[limit.state];
    worst_ = point;
    verdict_.worst = point.point;
  }

  /// The scene's own grid at several moments if the step reads the time; empty if it is not analysed.
  std::vector<OwnGrid> own_grids(const std::vector<ScenePoint>& points) const {
    std::vector<OwnGrid> grids;
    for (const FrozenPoint& moment : moments_of(worst_.point, points)) {
      std::optional<OwnGrid> grid = OwnGrid::make(session_, linear_, moment, verdict_.step, equations_);
      if (!grid) return {};
      grids.push_back(std::move(*grid));
    }
    return grids;
  }

  std::vector<FrozenPoint> moments_of_means(const std::vector<ScenePoint>& points) const {
    return linear_.couples_means() ? moments_of(worst_.point, points) : std::vector{worst_.point};
  }

  std::unique_ptr<CoupledRuns> coupled_runs(const FrozenPoint& moment) {
    if (!CoupledRuns::are_needed(session_, linear_)) return nullptr;
    const bool are_left_out = !look_.at_all_cells && CoupledRuns::are_too_long(session_, linear_);
    if (are_left_out) verdict_.runs = StabilityReport::Runs::left_out;
    return are_left_out ? nullptr : runs_about(moment);
  }

  std::unique_ptr<CoupledRuns> runs_about(const FrozenPoint& moment) {
    if (problem_.scheme.has_clamp()) without_clamps_ = step_without_clamps(problem_, linear_.group());
    if (without_clamps_ && linear_.couples_means()) without_clamps_ = without_clamps_->with_all_coupled();
    const LinearStep& linear = without_clamps_ ? *without_clamps_ : linear_;
    // Near poles short steps give the reference growth: there the differences grow, not the equations.
    const bool is_flow_known = linear.couples_means() || !CoupledRuns::are_needed(session_, linear);
    const LinearStep* euler = is_flow_known && !problem_.metric ? equations_.by_euler_steps() : nullptr;
    return CoupledRuns::make(session_, linear, moment, has_events_in_each_step(problem_), verdict_.step, euler);
  }

  /// The result on the scene's own grid replaces that of waves: these have frozen coefficients, may be longer than the
  /// grid, and see no walls. It is exact if the step is the same at all times. Not for semi-Lagrangian steps: their
  /// unstable steps may lie in narrow intervals, which a search can miss.
  void look_at_own(const std::vector<OwnGrid>& grids) {
    const StepLimit by_waves = verdict_.limit;
    verdict_.is_of_grid = true;
    verdict_.is_exact = !linear_.is_semi_lagrangian() && is_linear_and_steady(session_, linear_);
    verdict_.place.clear();
    verdict_.growth_rate = verdict_.growth_by_events = verdict_.beyond = 0;
    verdict_.growth = 1;
    verdict_.limit = {};
    for (const OwnGrid& grid : grids) {
      verdict_.growth_rate = std::max(verdict_.growth_rate, grid.growth_rate());
      verdict_.growth_by_events = std::max(verdict_.growth_by_events, grid.growth_by_events());
      const StepLimit limit = limit_on(grid, verdict_.step, by_waves);
      if (limit.largest() < verdict_.limit.largest()) {
        verdict_.limit = limit;
        verdict_.worst = grid.point();
      }
      if (verdict_.step <= limit.largest()) continue;
      verdict_.growth = std::max(verdict_.growth, grid.growth(verdict_.step));
      verdict_.beyond = std::max(verdict_.beyond, std::log(verdict_.growth) - grid.allowed(verdict_.step));
    }
    const bool is_lower = verdict_.limit.largest() < by_waves.largest();
    verdict_.is_of_walls = has_walls(problem_) && is_lower;
    verdict_.limit.wave = by_waves.wave;
    verdict_.limit.state = by_waves.state;
  }

  /// Whether growth is too small per step for matrix powers to show, but large over the run.
  bool grows_weakly(const OwnGrid& grid) const {
    const double steps = static_cast<double>(session_.steps()) * verdict_.parts;
    return steps * OwnGrid::least_growth > told_growth && steps * grid.sure_growth(verdict_.step) > told_growth;
  }

  /// The points by decreasing growth. In most cases the first then sets the limit, and the others are checked only
  /// there.
  std::vector<ScenePoint> worst_first(std::vector<ScenePoint> places) const {
    const double step = verdict_.limit.kind == StepLimit::Kind::limit ? verdict_.limit.step : verdict_.step;
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < places.size() && places.size() > 1; ++i)
      order.emplace_back(-walls_.rate(places[i], step), i);
    if (order.empty()) return places;
    std::ranges::sort(order);
    std::vector<ScenePoint> result;
    for (const auto& [rate, i] : order) result.push_back(std::move(places[i]));
    return result;
  }

  /// Lowers the limit to the largest step that `is_stable` accepts. Returns false, without a change, if it accepts the
  /// limit of waves and the scene's step. `unstable`: a step known as unstable; 0: none. `begins_to_grow`: as in
  /// StepSearch.
  bool lower_limit(const std::function<bool(double)>& is_stable, double precision, double unstable = 0,
                   const std::function<double(double)>& begins_to_grow = {}) {
    double low = verdict_.limit.step > 0 ? verdict_.limit.step : verdict_.step;
    if (unstable > 0) low = unstable;
    const double short_step = shortest * std::min(low, verdict_.step);
    if (is_stable(low)) {
      if (!(verdict_.step < low) || is_stable(verdict_.step)) return false;
      low = verdict_.step;
    }
    low = largest_stable({is_stable, precision, short_step, begins_to_grow}, low);
    const bool is_never = !(low > 0);
    verdict_.limit.kind = is_never ? StepLimit::Kind::never : StepLimit::Kind::limit;
    verdict_.limit.step = is_never ? 0 : low;
    verdict_.limit.order = 1;
    return true;
  }

  double length_of_run() const { return static_cast<double>(session_.steps()) * problem_.step; }

  /// Whether runs replace frozen waves in curved coordinates. Frozen slopes of lengths turn the energy that waves carry
  /// into growth. Elsewhere walls are analysed with frozen coefficients, and find growth that is too slow for runs.
  /// Semi-Lagrangian steps may be unstable in narrow intervals only.
  bool do_runs_decide() const {
    return problem_.metric && !linear_.is_semi_lagrangian() && !problem_.scheme.has_limiter() &&
           !folds_products(problem_, linear_.group()) && CoupledRuns::are_long(session_, linear_) &&
           is_linear_and_steady(session_, linear_);
  }

  /// A limit of waves stays if runs confirm it: it is known more accurately, with its wave. Growth at every step, which
  /// waves show without slopes, too (limit_at), may be too weak for runs.
  void decide_by_runs(const CoupledRuns& runs) {
    constexpr double confirmed = 1.01;
    const StepLimit by_waves = verdict_.limit;
    if (by_waves.kind == StepLimit::Kind::never && !may_be_artefact_of_curvature()) return;
    if (by_waves.kind == StepLimit::Kind::limit && runs.is_stable(by_waves.step) &&
        !runs.is_stable(confirmed * by_waves.step)) {
      verdict_.runs = StabilityReport::Runs::made;
      return;
    }
    verdict_.growth_rate = 0;
    leave_to_runs();
    look_at_runs(runs);
  }

  /// Lengths change so much from cell to cell there that frozen waves may grow where no disturbance of the grid does.
  bool may_be_artefact_of_curvature() const {
    constexpr std::size_t few_cells = 1024;
    return problem_.metric && session_.workspace().cell_count() <= few_cells &&
           verdict_.limit.kind == StepLimit::Kind::never;
  }

  void leave_to_runs() {
    verdict_.limit.kind = StepLimit::Kind::none;
    verdict_.growth = 1;
    verdict_.beyond = 0;
  }

  /// Runs of the tangent see walls, too.
  void look_at_runs(const CoupledRuns& runs) {
    if (verdict_.limit.kind == StepLimit::Kind::never) return;
    verdict_.runs = StabilityReport::Runs::made;
    const bool is_curved = problem_.metric.has_value(), takes_late_growth = is_curved && !do_runs_decide();
    if (takes_late_growth) verdict_.growth_rate = runs.late_growth_rate(verdict_.step);
    verdict_.growth_by_events = std::max(verdict_.growth_by_events, runs.growth_by_events());
    const auto is_stable = [&](double step) {
      look_.says(fmt::format("a step of {:.4g}: runs on the scene's own grid", step));
      return runs.is_stable(step);
    };
    double longest = verdict_.limit.step > 0 ? verdict_.limit.step : verdict_.step;
    while (verdict_.limit.kind == StepLimit::Kind::none && longest < farthest * verdict_.step && is_stable(longest))
      longest *= 2;
    if (verdict_.limit.kind == StepLimit::Kind::none) verdict_.limit.step = longest;
    const bool folds = folds_products(problem_, linear_.group());
    const double most = verdict_.limit.step;
    const double unstable =
        folds ? unstable_by_folding(is_stable, most, std::ranges::max(problem_.axes, {}, &model::Axis::cells).cells)
              : first_unstable(is_stable, runs.surely_short(), most);
    std::function<double(double)> begins_to_grow;  // elsewhere the followed vector may grow in steps below the limit
    if (is_curved) begins_to_grow = [&](double step) { return runs.begins_to_grow(step, precision_of_guess); };
    const bool is_lower =
        lower_limit(is_stable, folds ? precision_with_folding : precision_of_runs, unstable, begins_to_grow);
    const bool has_limit = is_lower && verdict_.limit.kind == StepLimit::Kind::limit;
    if (is_lower && !has_limit) verdict_.limit.order = std::max(1.0, runs.order_of_growth(verdict_.step));
    if (const double power = has_limit ? runs.power_of_growth(verdict_.limit.step) : 0; power > 0)
      verdict_.limit = {StepLimit::Kind::never, 0, power, verdict_.limit.wave, verdict_.limit.state};
    if (!takes_late_growth) {
      const double step = verdict_.limit.step > 0 ? std::min(verdict_.step, verdict_.limit.step) : verdict_.step;
      verdict_.growth_rate = std::max(verdict_.growth_rate, runs.growth_rate(step));
    }
    if ((is_curved || (folds && verdict_.growth_rate > 0)) && verdict_.limit.kind != StepLimit::Kind::never)
      verdict_.short_waves = runs.short_waves(verdict_.step, safely * verdict_.limit.step, length_of_run());
    if (!is_lower) {
      if (verdict_.limit.kind == StepLimit::Kind::none) verdict_.limit.step = 0;
      return;
    }
    verdict_.is_of_means = true;
    verdict_.place.clear();
    const double growth = runs.growth(verdict_.step);
    verdict_.growth = std::max(verdict_.growth, std::exp(growth));
    verdict_.beyond =
        std::max(verdict_.beyond, growth - 2 * verdict_.growth_rate * verdict_.step - verdict_.growth_by_events);
  }

  /// Walls can cause growth that no wave shows, which lowers the limit. They can also damp, but that raises no limit.
  void look_at_walls(const ScenePoint& at) {
    const bool has_limit = verdict_.limit.kind == StepLimit::Kind::limit;
    const double short_step = shortest * std::min(has_limit ? verdict_.limit.step : verdict_.step, verdict_.step);
    const double allowed = 2 * std::max(walls_.own_rate(at, short_step), verdict_.growth_rate);
    const double by_events = walls_.growth_by_events(at);
    const auto beyond = [&](double step) { return (walls_.rate(at, step) - allowed) * step - by_events; };
    if (!lower_limit([&](double step) { return beyond(step) <= wall_tolerance; }, 1e-3)) return;
    verdict_.is_of_walls = true;
    verdict_.place = at.place;
    verdict_.worst = at.point;
    verdict_.beyond = std::max(verdict_.beyond, beyond(verdict_.step));
    verdict_.growth = std::max(verdict_.growth, std::exp(walls_.rate(at, verdict_.step) * verdict_.step));
  }

  driver::Session& session_;
  const model::Problem& problem_;
  const Look& look_;
  const LinearStep linear_;
  StabilityReport& verdict_;
  int rank_;
  Equations equations_;
  WallRates walls_;
  std::optional<LinearStep> without_clamps_;  // of runs
  ScenePoint worst_;
  bool is_any_ = false;
};

}  // namespace

bool examine_group(driver::Session& session, const LinearStep& linear, const Look& look, StabilityReport& verdict) {
  return Examination(session, session.problem(), linear, look, verdict).run();
}

std::optional<double> limit_by_other_scheme(driver::Session& session, const model::Problem& other) {
  const ConsistentStart start(session);
  double least = std::numeric_limits<double>::infinity();
  for (const LinearStep& linear : linear_steps(other)) {
    StabilityReport verdict;
    if (!Examination(session, other, linear, {}, verdict).run() || verdict.limit.kind == StepLimit::Kind::never)
      return std::nullopt;
    if (verdict.limit.kind == StepLimit::Kind::limit) least = std::min(least, verdict.limit.step);
  }
  return std::isfinite(least) ? std::optional(least) : std::nullopt;
}

bool grows_nothing_in(driver::Session& session, const LinearStep& linear, const Look& look) {
  StabilityReport verdict;
  return Examination(session, session.problem(), linear, look, verdict).grows_nothing();
}

}  // namespace dpde::stability
