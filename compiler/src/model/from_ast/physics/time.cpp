// SPDX-License-Identifier: Apache-2.0
// Begin, step and number of steps of the run; times used by a task.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/coordinates.h"

namespace dpde::model {

namespace {

constexpr double step_tolerance = 1e-9;  // relative

struct Duration {
  double from = 0, to = 0;
  SourceRange range;
};

std::string text_of(double value) { return fmt::format("{}", value); }

template <class Kind>
const Found<Kind>* only(Elaboration& elaboration, const std::vector<Found<Kind>>& items, const std::string& what) {
  for (std::size_t i = 1; i < items.size(); ++i) report_duplicate(elaboration, what, items[i].range, items[0].range);
  return items.empty() ? nullptr : &items.front();
}

/// The setting, else the step of the file; nullopt after a diagnostic.
std::optional<double> step_of(Elaboration& elaboration, const Found<ast::TimeItem>* time) {
  const auto lines = items_of<ast::StepItem>(elaboration.blocks.scene->items);
  const auto* line = only(elaboration, lines, "the step");
  const ast::Expr* written = line ? &line->kind.step : nullptr;
  if (time && time->kind.step) {
    if (line) report_duplicate(elaboration, "the step", line->range, time->kind.step->range());
    written = &*time->kind.step;
  }
  const bool is_set = elaboration.settings.find("step") != nullptr;
  if (!is_set && !written) {
    elaboration.sink.report("missing-step", time ? time->range : elaboration.blocks.scene->name.range,
                            {elaboration.problem.scene},
                            time ? "write , step 1/128 after the duration" : "write step 1/128");
    return std::nullopt;
  }
  const auto step = is_set ? number_setting(elaboration, "step") : evaluate(elaboration, *written, "the step");
  if (!step || *step > 0) return step;
  elaboration.sink.report("bad-step", is_set ? SourceRange{} : written->range(), {"time step", text_of(*step)});
  return std::nullopt;
}

std::optional<Duration> duration_of_loop(Elaboration& elaboration, std::optional<double> step) {
  const ast::Loop* loop = find_loop(elaboration);
  if (!loop) {
    elaboration.sink.report("missing-time", elaboration.blocks.scene->name.range, {elaboration.problem.scene},
                            elaboration.blocks.program
                                ? "write time 0 .. 1, step 1/128 in the scene, or a loop around the program"
                                : "write time 0 .. 1, step 1/128");
    return std::nullopt;
  }
  if (!step) return std::nullopt;
  return Duration{loop->from * *step, loop->to * *step, loop->counter.range};
}

std::optional<Duration> duration_of(Elaboration& elaboration, const Found<ast::TimeItem>* time,
                                    std::optional<double> step) {
  std::optional<Duration> duration;
  if (time) {
    const auto from = evaluate(elaboration, time->kind.from, "the time"),
               to = evaluate(elaboration, time->kind.to, "the time");
    if (from && to) duration = Duration{*from, *to, time->kind.to.range()};
  } else {
    duration = duration_of_loop(elaboration, step);
  }
  if (!elaboration.settings.find("end")) return duration;
  const auto end = number_setting(elaboration, "end");
  if (!end || !duration) return std::nullopt;
  return Duration{duration->from, *end, {}};
}

}  // namespace

std::optional<double> whole_steps(double length, double step) {
  const double steps = std::round(length / step);
  const bool fits = std::abs(length - steps * step) <= step_tolerance * std::max(std::abs(length), step);
  return fits ? std::optional(steps) : std::nullopt;
}

namespace {

/// The setting, else the number of the file; 0 without either and after a diagnostic.
double courant_of(Elaboration& elaboration, const Found<ast::TimeItem>* time) {
  const bool is_set = elaboration.settings.find("courant") != nullptr;
  const ast::Expr* written = time && time->kind.courant ? &*time->kind.courant : nullptr;
  if (time && time->kind.speed && !written && !is_set) {
    elaboration.sink.report("not-allowed-here", time->kind.speed->range(),
                            {"a speed", "a time without a Courant number"}, "write courant 0.5, speed ...");
  }
  if (!is_set && !written) return 0;
  const auto courant =
      is_set ? number_setting(elaboration, "courant") : evaluate(elaboration, *written, "the Courant number");
  if (!courant) return 0;
  if (*courant > 0) return *courant;
  elaboration.sink.report("bad-step", is_set ? SourceRange{} : written->range(), {"Courant number", text_of(*courant)});
  return 0;
}

/// At cell centres, whatever the placement of the speed.
Expr over_spacing(const Problem& problem, const Expr& speed, int axis) {
  const std::optional<Placement> place = Placements(problem).natural(speed);
  const Expr centred = place && *place != Placement{} ? interpolate(speed) : speed;
  return binary(BinaryOp::divide, model::call(Fn::abs, {centred}), param(std::string("h").append(axis_name(axis))));
}

/// The maximum over all advection velocities of their rates, for the substeps of their equations.
std::optional<Expr> rate_of_advection(const Problem& problem) {
  std::optional<Expr> rate;
  std::vector<std::pair<std::vector<Expr>, int>> seen;
  int parts = 1;
  const std::function<void(const Expr&)> visit = [&](const Expr& e) {
    const auto* advect = as<Advect>(e);
    if (advect && std::find(seen.begin(), seen.end(), std::pair(advect->velocity, parts)) == seen.end()) {
      seen.emplace_back(advect->velocity, parts);
      Expr own = 0.0;
      for (int axis = 0; axis < static_cast<int>(advect->velocity.size()); ++axis) {
        own = binary(BinaryOp::add, own, over_spacing(problem, advect->velocity[static_cast<std::size_t>(axis)], axis));
      }
      if (parts > 1) own = binary(BinaryOp::divide, own, parts);
      rate = rate ? model::call(Fn::max, {*rate, own}) : own;
    }
    for_each_child(e, visit);
  };
  for (const State& state : problem.states) {
    parts = state.parts;
    if (state.rhs) visit(*state.rhs);
  }
  return rate;
}

/// A vector along each axis, or one number for all axes.
std::optional<Expr> rate_of_speed(Elaboration& elaboration, const ast::Expr& speed) {
  const TypedExpr value = formulas::numeric({elaboration, FormulaContext::equation, "the speed"}, speed);
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  if (value.type == TypedExpr::Type::tensor) {
    elaboration.sink.report("not-a-number", speed.range(), {describe(value)},
                            "a speed is a number, or one along each axis");
    return std::nullopt;
  }
  const Coordinates coordinates(elaboration.problem, {speed.range()});
  Expr rate = 0.0;
  for (int axis = 0; axis < static_cast<int>(elaboration.problem.axes.size()); ++axis) {
    const std::size_t part = value.type == TypedExpr::Type::vector ? static_cast<std::size_t>(axis) : 0;
    const std::vector<Expr> speeds =
        coordinates.speeds(std::vector(elaboration.problem.axes.size(), value.parts[part]));
    rate = binary(BinaryOp::add, rate, over_spacing(elaboration.problem, speeds[static_cast<std::size_t>(axis)], axis));
  }
  return rate;
}

}  // namespace

void bind_courant(Elaboration& elaboration) {
  const auto lines = items_of<ast::TimeItem>(elaboration.blocks.scene->items);
  const Found<ast::TimeItem>* time = lines.empty() ? nullptr : &lines.front();
  Problem& problem = elaboration.problem;
  const double courant = courant_of(elaboration, time);
  if (courant == 0) return;
  if (elaboration.blocks.program) {
    elaboration.sink.report("not-allowed-here", time ? time->range : SourceRange{},
                            {"a Courant number", "a scene of a program"}, "give the step alone");
    return;
  }
  problem.substeps.courant = courant;
  problem.substeps.rate =
      time && time->kind.speed ? rate_of_speed(elaboration, *time->kind.speed) : rate_of_advection(problem);
  if (problem.substeps.rate || elaboration.sink.has_errors()) return;
  elaboration.sink.report("missing-speed", time ? time->range : SourceRange{}, {problem.scene},
                          "write , courant 0.5, speed |u| + c: a vector, or a number for all axes");
}

void bind_time(Elaboration& elaboration) {
  const auto lines = items_of<ast::TimeItem>(elaboration.blocks.scene->items);
  const auto* time = only(elaboration, lines, "the time");
  const auto step = step_of(elaboration, time);
  const auto duration = duration_of(elaboration, time, step);
  if (time) elaboration.problem.time_origin = {time->range};
  if (!step || !duration) return;
  if (!(duration->to > duration->from)) {
    elaboration.sink.report("bad-duration", duration->range, {text_of(duration->from), text_of(duration->to)});
    return;
  }
  const double length = duration->to - duration->from;
  auto steps = whole_steps(length, *step);
  if (!steps && time && time->kind.steady) steps = std::ceil(length / *step);  // the end is only the time to give up
  if (!steps || *steps < 1) {  // a step much longer than the run is 0 steps to within rounding
    elaboration.sink.report(
        "uneven-steps", duration->range, {text_of(duration->from), text_of(duration->to), text_of(*step)},
        fmt::format("a step of {} makes {} of them", length / std::ceil(length / *step), std::ceil(length / *step)));
    return;
  }
  if (*steps > std::numeric_limits<int>::max()) {
    elaboration.sink.report("too-many-steps", duration->range, {text_of(*steps)});
    return;
  }
  elaboration.problem.t_begin = duration->from;
  elaboration.problem.step = *step;
  elaboration.problem.steps = static_cast<int>(*steps);
}

namespace {

std::optional<Reduce::Kind> counted_as(const std::optional<ast::Identifier>& word) {
  if (!word) return std::nullopt;
  return word->name == "mean" ? Reduce::Kind::mean : word->name == "sum" ? Reduce::Kind::sum : Reduce::Kind::integral;
}

}  // namespace

When when_of(Elaboration& elaboration, const ast::When& when, bool on_steps) {
  if (std::holds_alternative<ast::WhenEnd>(when)) return {};
  if (const auto* over = std::get_if<ast::WhenOver>(&when))
    return {When::Kind::over, {}, 0, false, counted_as(over->counted)};
  if (const auto* steps = std::get_if<ast::WhenSteps>(&when)) {
    if (!learns_from_trajectories(elaboration)) {
      elaboration.sink.report("not-allowed-here", steps->steps.range(),
                              {"a number of steps", "a task that does not learn from trajectories"},
                              "write over time, or at t = 1");
      return {};
    }
    const auto count = evaluate(elaboration, steps->steps, "a number of steps");
    const auto counted = counted_as(steps->counted);
    if (!count) return {When::Kind::steps, {}, 1, steps->is_last, counted};
    if (*count >= 1 && *count <= 1e6 && *count == std::floor(*count))
      return {When::Kind::steps, {}, static_cast<int>(*count), steps->is_last, counted};
    elaboration.sink.report("not-whole", steps->steps.range(), {fmt::format("{}", *count)});
    return {When::Kind::steps, {}, 1, steps->is_last, counted};
  }
  When result{When::Kind::at, {}};
  const Problem& problem = elaboration.problem;
  for (const ast::Expr& e : std::get<ast::WhenAt>(when).times) {
    const auto time = evaluate(elaboration, e, "a time");
    if (!time) continue;
    result.times.push_back(*time);
    if (!on_steps || problem.steps == 0) continue;
    const double step = problem.step, place = (*time - problem.t_begin) / step;
    const bool in_range = place > -0.5 && place < problem.steps + 0.5;
    if (in_range && whole_steps(*time - problem.t_begin, step)) continue;
    const double nearest = std::min(std::max(std::round(place), 0.0), static_cast<double>(problem.steps));
    elaboration.sink.report("time-off-step", e.range(), {text_of(*time)},
                            fmt::format("the nearest is t = {}", problem.t_begin + nearest * step));
  }
  return result;
}

}  // namespace dpde::model
