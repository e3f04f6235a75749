// SPDX-License-Identifier: Apache-2.0
#include "stability/equations.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "driver/compile/time_averages.h"
#include "model/analyse/solves.h"
#include "model/boundary/stretch.h"
#include "model/build.h"
#include "model/uses.h"
#include "stability/frozen/one_moment.h"
#include "stencil/lower/from_model.h"

namespace dpde::stability {

namespace {

/// Whether some trajectory of the flow ends on a wall. Its end depends on the distance to the wall, in the whole grid.
bool have_ways_that_end(const model::Problem& problem) {
  bool lies_on_walls = false;
  for (const model::State& state : problem.states) {
    for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
      const bool is_bounded = problem.axes[axis].topology == Topology::bounded;
      lies_on_walls = lies_on_walls || (state.placement[axis] && is_bounded);
    }
  }
  return lies_on_walls && problem.scheme.is_semi_lagrangian();
}

constexpr double finer = 16;  // the spacing of a Symbol is the scene's divided by this

model::Problem without_rare_events(model::Problem problem) {
  std::erase_if(problem.events, [&](const model::Event& event) { return !is_of_each_step(event, problem); });
  return problem;
}

/// The equations with differences of order 8, whatever the scheme's order is.
model::Problem with_fine_differences(model::Problem problem) {
  problem.scheme.transport = {model::Advection::central, 8};
  problem.scheme.transports.clear();
  problem.scheme.derivative_order = problem.scheme.laplacian_order = 8;
  problem.scheme.dealias = false;
  return problem;
}

/// The problem on periodic axes.
model::Problem boundless(model::Problem problem) {
  for (model::Axis& axis : problem.axes) axis.topology = Topology::periodic;
  return problem;
}

/// A step as statements.
struct Lowered {
  stencil::Module module;
  std::string step;
  double t_begin = 0;
  bool of_constraints = false;
  std::optional<LinearStep> of(const StateGroup& group) const {
    std::string why;
    std::optional<LinearStep> linear =
        LinearStep::make(at_one_moment(module, t_begin), step, why, of_constraints, group);
    return linear && !linear->has_networks() ? std::move(linear) : std::nullopt;
  }
};

std::optional<Lowered> lowered(const model::Problem& written) {
  if (!written.program.empty()) return std::nullopt;
  const model::Problem problem = have_ways_that_end(written) ? boundless(written) : written;
  DiagnosticSink sink;
  const stencil::ProgramNames names = stencil::program_names(problem);
  Lowered result{stencil::from_model(driver::spread_over_time(problem), names, sink), names.step, problem.t_begin,
                 model::are_constraints(problem)};
  return sink.has_errors() ? std::nullopt : std::optional(std::move(result));
}

}  // namespace

std::optional<LinearStep> linear_step(const model::Problem& problem, const StateGroup& group) {
  const std::optional<Lowered> step = lowered(problem);
  return step ? step->of(group) : std::nullopt;
}

std::vector<LinearStep> linear_steps(const model::Problem& problem) {
  const std::optional<Lowered> step = lowered(problem);
  std::vector<LinearStep> result;
  for (const StateGroup& group : step ? state_groups(step->module, step->step) : std::vector<StateGroup>{}) {
    std::optional<LinearStep> linear = step->of(group);
    if (!linear) return {};
    result.push_back(std::move(*linear));
  }
  return result;
}

std::optional<LinearStep> linear_step(const driver::Session& session, std::string& why, const StateGroup& group) {
  const model::Problem& problem = session.problem();
  if (have_ways_that_end(problem) || has_rare_events(problem)) return linear_step(without_rare_events(problem), group);
  std::optional<LinearStep> step = compiled_step(session, why, group);
  if (!step || !step->has_networks()) return step;
  why = "a network is in it";
  return std::nullopt;
}

std::optional<LinearStep> step_without_clamps(const model::Problem& written, const StateGroup& group) {
  model::Problem problem = without_rare_events(written);
  const auto take_out = [](model::Transport& transport) {
    if (model::is_maccormack(transport.advect)) transport = {model::Advection::semi_lagrangian, 1};
  };
  take_out(problem.scheme.transport);
  for (auto& [state, transport] : problem.scheme.transports) take_out(transport);
  return linear_step(problem, group);
}

std::vector<StateGroup> state_groups(const driver::Session& session) {
  const model::Problem& problem = session.problem();
  const bool is_other = have_ways_that_end(problem) || has_rare_events(problem);
  const std::optional<Lowered> step = is_other ? lowered(without_rare_events(problem)) : std::nullopt;
  if (step) return state_groups(step->module, step->step);
  return state_groups(session.compiled().stencil, session.compiled().step_name());
}

std::optional<LinearStep> compiled_step(const driver::Session& session, std::string& why, const StateGroup& group) {
  const driver::Compiled& compiled = session.compiled();
  const bool of_constraints = session.problem().program.empty() && model::are_constraints(session.problem());
  return LinearStep::make(at_one_moment(compiled.stencil, session.problem().t_begin), compiled.step_name(), why,
                          of_constraints, group);
}

bool is_of_each_step(const model::Event& event, const model::Problem& problem) {
  return event.after_step || (event.every == 1 && !problem.has_parts());
}

bool has_rare_events(const model::Problem& problem) {
  return !std::ranges::all_of(problem.events, [&](const auto& event) { return is_of_each_step(event, problem); });
}

bool has_events_in_each_step(const model::Problem& problem) {
  return std::ranges::any_of(problem.events, [&](const auto& event) { return is_of_each_step(event, problem); });
}

model::Problem by_euler(model::Problem problem) {
  std::erase_if(problem.states, [](const model::State& state) { return !state.history_of.empty(); });
  for (model::State& state : problem.states) state.parts = 1;
  problem.events.clear();
  problem.scheme.time = model::time_method("euler");
  problem.scheme.split = {};
  return problem;
}

std::optional<LinearisedStep> generator_of(const LinearStep& euler, const FrozenPoint& point) {
  double dt = 1;
  std::optional<LinearisedStep> step = euler.response(point, dt);
  if (!step) return std::nullopt;
  // dt is so large that the 1 in 1 + dt*L costs L no digits.
  if (const double size = magnitude_of(*step); size > 0) dt = 1024 / size;
  step = euler.response(point, dt);
  if (!step) return std::nullopt;
  LinearisedStep rates{{}, step->waves};
  for (std::size_t row = 0; row < step->rows.size(); ++row)
    rates.rows.push_back(step->rows[row].plus(LinearForm(static_cast<int>(row)).times(-1)).times(1 / dt));
  return rates;
}

Eigen::VectorXcd Symbol::eigenvalues(Angles angles) const {
  for (double& angle : angles) angle /= finer;
  return rates_.eigenvalues(angles);
}

Equations::Equations(model::Problem problem, StateGroup group)
    : problem_(std::move(problem)), group_(std::move(group)) {
  if (!has_events_in_each_step(problem_)) return;
  model::Problem plain = problem_;
  plain.events.clear();
  without_events_ = linear_step(plain, group_);
}

StepOfRates Equations::step_of_rates() const {
  return problem_.program.empty() ? StepOfRates(problem_.scheme.time) : StepOfRates();
}

const LinearStep* Equations::by_euler_steps() const {
  if (!is_euler_made_) euler_ = linear_step(by_euler(problem_), group_);
  is_euler_made_ = true;
  return euler_ ? &*euler_ : nullptr;
}

std::optional<LinearisedStep> Equations::rates_at(const FrozenPoint& point) const {
  const LinearStep* euler = by_euler_steps();
  return euler != nullptr ? generator_of(*euler, point) : std::nullopt;
}

std::vector<StepOfRates::Place> Equations::places_in(const LinearStep& step) const {
  const LinearStep* euler = by_euler_steps();
  std::vector<StepOfRates::Place> places;
  for (const std::string& name : step.states()) {
    StepOfRates::Place place;
    const model::State* state = problem_.find_state(name);
    for (; state != nullptr && !state->history_of.empty(); ++place.memory)
      state = problem_.find_state(state->history_of);
    if (euler == nullptr || state == nullptr) return {};
    const auto row = std::ranges::find(euler->states(), state->name);
    if (row == euler->states().end()) return {};
    place.row = static_cast<std::size_t>(row - euler->states().begin());
    places.push_back(place);
  }
  return places;
}

bool Equations::are_spectral() const {
  const auto is_difference = [&](const model::Expr& e) {
    const bool is_any = is<model::Derivative, model::Advect, model::Shift>(e);
    return is_any && !model::is_spectral(problem_.scheme, e);
  };
  const auto has_differences = [&](const model::Use& use) {
    const bool is_of_rates = model::makes_state(use.kind) && use.kind != model::UseKind::event;
    return is_of_rates && is_in(group_, use.owner) && any_part(use.formula, is_difference);
  };
  return problem_.program.empty() && !model::any_formula(problem_, has_differences);
}

std::optional<Symbol> Equations::about(const FrozenPoint& point) const {
  if (!is_made_) fine_ = linear_step(with_fine_differences(by_euler(problem_)), group_);
  is_made_ = true;
  if (!fine_) return std::nullopt;
  FrozenPoint on_fine_cells = point;
  for (const model::Axis& axis : problem_.axes) on_fine_cells.params.at("h" + axis.name) /= finer;
  for (auto* fields : {&on_fine_cells.fields, &on_fine_cells.whole}) {
    for (auto& [name, field] : *fields) {
      for (double& slope : field.slope) slope /= finer;
    }
  }
  // A wave about a point is stretched by the grid's metric at that point. The slope of the metric is not part of the
  // equations. It would also make the slope that a constraint subtracts differ from the one that it measures.
  for (const model::Coefficient& metric : problem_.coefficients) {
    const auto found = on_fine_cells.fields.find(metric.name);
    if (found != on_fine_cells.fields.end() && model::is_metric(problem_, metric)) found->second.slope = {};
  }
  const std::optional<LinearisedStep> rates = generator_of(*fine_, on_fine_cells);
  return rates ? std::optional(Symbol(*rates, static_cast<int>(problem_.axes.size()))) : std::nullopt;
}

FrozenPoint flat(FrozenPoint point) {
  for (auto& [name, field] : point.fields) field.slope = {};
  return point;
}

double magnitude_of(const LinearisedStep& response) {
  double sum = 0;
  for (const LinearForm& row : response.rows) {
    for (const LinearForm::Term& term : row.terms()) sum += std::abs(term.coefficient);
  }
  return sum;
}

}  // namespace dpde::stability
