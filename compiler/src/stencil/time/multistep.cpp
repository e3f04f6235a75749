// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/multistep.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <span>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/time/projections.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

Expr dt() { return param("dt"); }

class Multistep {
 public:
  Multistep(const Lowering& lowering, const std::vector<Advance>& advances)
      : problem_(lowering.problem()), advances_(advances), at_point_(lowering.discretiser()) {}

  std::vector<Stage> stages(Kernel kernel);

 private:
  Expr next(const Advance& advance);
  Expr next_position(const std::string& state, const model::State& velocity);
  Expr next_velocity(const model::State& velocity);
  Expr next_history(const model::State& history) const;
  Expr rate(const Advance& advance);
  /// Whether this is one of the first steps.
  Expr is_within(int steps) const;
  /// A number with another value in the first step.
  Expr at_first(const std::string& name, const Expr& first, const Expr& later);
  Expr weight_of_difference(std::size_t j);
  model::Placement placement_of(const std::string& state) const { return at_point_.placements().of(state); }
  bool is_adams_bashforth() const { return model::is_adams_bashforth(problem_.scheme.time); }
  Expr next_by_rates(const Advance& advance);

  const model::Problem& problem_;
  const std::vector<Advance>& advances_;
  Discretiser at_point_;
  std::map<std::string, Expr> shared_;  // by name: rates, velocities and numbers that are used several times
};

Expr Multistep::is_within(int steps) const {
  return binary(BinaryOp::less, param("t"), problem_.t_begin + (steps == 1 ? dt() / 2.0 : (steps - 0.5) * dt()));
}

Expr Multistep::at_first(const std::string& name, const Expr& first, const Expr& later) {
  const auto found = shared_.find(name);
  if (found != shared_.end()) return found->second;
  return shared_.emplace(name, at_point_.shared(name, select(is_within(1), first, later))).first->second;
}

Expr Multistep::rate(const Advance& advance) {
  const std::string name = advance.state + "_rate_now";
  const auto found = shared_.find(name);
  if (found != shared_.end()) return found->second;
  return shared_.emplace(name, at_point_.shared(name, at_point_(advance.rate, placement_of(advance.state))))
      .first->second;
}

Expr Multistep::next(const Advance& advance) {
  const Expr here = access(advance.state);
  const model::State* velocity = problem_.velocity_of(advance.state);
  if (velocity && !is_adams_bashforth()) return next_position(advance.state, *velocity);
  const model::State& own = *problem_.find_state(advance.state);
  if (!own.velocity_of.empty() && !is_adams_bashforth()) return next_velocity(own);
  const model::State* history = problem_.history_of(advance.state);
  if (!history) return here;
  if (is_adams_bashforth()) return next_by_rates(advance);
  const Expr before = access(history->name);
  const Expr euler = at_first("is_first", 1.0, 0.0);
  return before + euler * (here - before) + (2.0 - euler) * dt() * rate(advance);
}

/// Absolute value of the weight of F_(j-1) - F_j, j = 1, 2, ..., with F_0 the current rate: the sum of the weights of
/// F_j and of all older rates, whose sign alternates with j. The starting steps have other weights.
Expr Multistep::weight_of_difference(std::size_t j) {
  const std::string name = j == 1 ? "weight_before" : j == 2 ? "weight_older" : fmt::format("weight_{}", j);
  const auto found = shared_.find(name);
  if (found != shared_.end()) return found->second;
  const std::span<const model::AdamsRow> rows = problem_.scheme.time->rates;
  const auto weight_in = [&](std::size_t step) {
    double sum = 0;
    for (std::size_t i = j; i < rows[step].size(); ++i) sum += rows[step][i];
    return sum == 0 ? 0 : j % 2 == 1 ? -sum : sum;
  };
  Expr weight = weight_in(rows.size() - 1);
  for (std::size_t step = rows.size() - 1; step-- > 0;) {
    if (weight_in(step) != weight_in(step + 1))
      weight = select(is_within(static_cast<int>(step) + 1), weight_in(step), weight);
  }
  return shared_.emplace(name, at_point_.shared(name, weight)).first->second;
}

/// With F_1 and F_2 the rates of the two previous steps, ab3 is u + dt (F + 11/12 (F - F_1) - 5/12 (F_1 - F_2)).
Expr Multistep::next_by_rates(const Advance& advance) {
  Expr sum = rate(advance), newer = sum;
  const model::State* history = problem_.history_of(advance.state);
  for (std::size_t j = 1; history != nullptr; ++j, history = problem_.history_of(history->name)) {
    const Expr older = access(history->name), change = weight_of_difference(j) * (newer - older);
    sum = j % 2 == 1 ? sum + change : sum - change;
    newer = older;
  }
  return access(advance.state) + dt() * sum;
}

Expr Multistep::next_position(const std::string& state, const model::State& velocity) {
  return access(state) + dt() * next_velocity(velocity);
}

Expr Multistep::next_velocity(const model::State& velocity) {
  const std::string name = velocity.name + "_now";
  const auto found = shared_.find(name);
  if (found != shared_.end()) return found->second;
  const model::Linear force = *model::linear_in(*velocity.rhs, velocity.name);
  const Expr step = at_first("velocity_step", dt() / 2.0, dt());
  const Expr push = scaled(step, at_point_(force.rest, velocity.placement)), here = access(velocity.name);
  Expr value = here + push;
  if (!is_literal(force.factor, 0)) {
    const Expr damping = at_point_.shared(velocity.name + "_damping", at_point_(force.factor, velocity.placement));
    const Expr implicit = at_first("implicit_step", 0.0, dt() / 2.0);
    value = ((1.0 + dt() / 2.0 * damping) * here + push) / (1.0 - implicit * damping);
  }
  return shared_.emplace(name, at_point_.shared(name, value)).first->second;
}

Expr Multistep::next_history(const model::State& history) const {
  const bool is_of_rate = is_adams_bashforth() && problem_.find_state(history.history_of)->history_of.empty();
  return is_of_rate ? shared_.at(history.history_of + "_rate_now") : access(history.history_of);
}

std::vector<Stage> Multistep::stages(Kernel kernel) {
  for (const Advance& advance : advances_) {  // histories follow the states whose rates they store
    const model::State& state = *problem_.find_state(advance.state);
    const Expr value = state.history_of.empty() ? next(advance) : next_history(state);
    kernel.stores.push_back({advance.into, false, value, advance.origin});
  }
  return {Lowering::stage(std::move(kernel), at_point_)};
}

}  // namespace

std::vector<std::vector<std::vector<double>>> multistep_matrix(model::TimeScheme time) {
  if (model::is_leapfrog(time)) return {{{0, 2}, {1}}, {{1}, {}}};
  if (!model::is_adams_bashforth(time)) return {};
  const std::size_t count = time->rates.size();
  std::vector<std::vector<std::vector<double>>> matrix(count, std::vector<std::vector<double>>(count));
  for (std::size_t j = 0; j < count; ++j) matrix[0][j] = {time->rates.back()[j]};
  matrix[0][0] = {1, time->rates.back()[0]};
  matrix[1][0] = {0, 1};
  for (std::size_t j = 2; j < count; ++j) matrix[j][j - 1] = {1};
  return matrix;
}

std::vector<Stage> multistep_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name) {
  FieldsOfStates into;
  for (const Advance& advance : advances) into[advance.state] = advance.into;
  const FieldsOfStates left = before_projection(lowering, into);
  std::vector<Advance> free;
  for (Advance advance : advances) {
    const auto found = left.find(advance.state);
    if (found == left.end()) continue;
    advance.into = found->second;
    free.push_back(std::move(advance));
  }
  std::vector<Stage> stages = Multistep(lowering, free).stages(lowering.kernel(name));
  std::ranges::move(projection_stages(lowering, {name, left, into, param("t") + dt(), dt(), dt()}),
                    std::back_inserter(stages));
  return stages;
}

}  // namespace dpde::stencil
