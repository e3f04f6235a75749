// SPDX-License-Identifier: Apache-2.0
#include "stencil/multistep.h"

#include <algorithm>
#include <iterator>
#include <map>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/projections.h"
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
  /// A number that is different in the first step, or in the first ones.
  Expr at_first(const std::string& name, const Expr& first, const Expr& later, int steps = 1);
  model::Placement placement_of(const std::string& state) const { return at_point_.placements().of(state); }
  bool keeps_rates() const { return model::keeps_rates(problem_.scheme.time); }
  Expr next_by_rates(const Advance& advance, const model::State& history);

  const model::Problem& problem_;
  const std::vector<Advance>& advances_;
  Discretiser at_point_;
  std::map<std::string, Expr> shared_;  // by name: rates, velocities and numbers that are used twice
};

Expr Multistep::is_within(int steps) const {
  return binary(BinaryOp::less, param("t"), problem_.t_begin + (steps == 1 ? dt() / 2.0 : (steps - 0.5) * dt()));
}

Expr Multistep::at_first(const std::string& name, const Expr& first, const Expr& later, int steps) {
  const auto found = shared_.find(name);
  if (found != shared_.end()) return found->second;
  return shared_.emplace(name, at_point_.shared(name, select(is_within(steps), first, later))).first->second;
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
  if (velocity && !keeps_rates()) return next_position(advance.state, *velocity);
  const model::State& own = *problem_.find_state(advance.state);
  if (!own.velocity_of.empty() && !keeps_rates()) return next_velocity(own);
  const model::State* history = problem_.history_of(advance.state);
  if (!history) return here;
  if (keeps_rates()) return next_by_rates(advance, *history);
  const Expr before = access(history->name);
  const Expr euler = at_first("is_first", 1.0, 0.0);
  return before + euler * (here - before) + (2.0 - euler) * dt() * rate(advance);
}

/// With F_1 and F_2 the rates of the two steps before, ab3 is u + dt (F + 11/12 (F - F_1) - 5/12 (F_1 - F_2)).
Expr Multistep::next_by_rates(const Advance& advance, const model::State& history) {
  const Expr here = access(advance.state), now = rate(advance), before = access(history.name);
  if (problem_.scheme.time == model::TimeScheme::ab2) {
    const Expr weight = at_first("weight_before", 0.0, 0.5);
    return here + dt() * ((1.0 + weight) * now - weight * before);
  }
  const Expr older = access(problem_.history_of(history.name)->name);
  const Expr bend = at_first("weight_before", 0.0, select(is_within(2), 1.0, 11.0 / 12));
  const Expr bend_before = at_first("weight_older", 0.0, 5.0 / 12, 2);
  return here + dt() * (now + bend * (now - before) - bend_before * (before - older));
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
  if (!model::is_constant(force.factor, 0)) {
    const Expr damping = at_point_.shared(velocity.name + "_damping", at_point_(force.factor, velocity.placement));
    const Expr implicit = at_first("implicit_step", 0.0, dt() / 2.0);
    value = ((1.0 + dt() / 2.0 * damping) * here + push) / (1.0 - implicit * damping);
  }
  return shared_.emplace(name, at_point_.shared(name, value)).first->second;
}

Expr Multistep::next_history(const model::State& history) const {
  const bool is_of_rate = keeps_rates() && problem_.find_state(history.history_of)->history_of.empty();
  return is_of_rate ? shared_.at(history.history_of + "_rate_now") : access(history.history_of);
}

std::vector<Stage> Multistep::stages(Kernel kernel) {
  for (const Advance& advance : advances_) {  // histories come behind the states whose rates they take
    const model::State& state = *problem_.find_state(advance.state);
    const Expr value = state.history_of.empty() ? next(advance) : next_history(state);
    kernel.stores.push_back({advance.into, false, value, advance.origin});
  }
  return {Lowering::stage(std::move(kernel), at_point_)};
}

}  // namespace

std::vector<std::vector<std::vector<double>>> multistep_matrix(model::TimeScheme time) {
  if (time == model::TimeScheme::ab2) return {{{1, 1.5}, {-0.5}}, {{0, 1}, {}}};
  if (time == model::TimeScheme::ab3)
    return {{{1, 23.0 / 12}, {-16.0 / 12}, {5.0 / 12}}, {{0, 1}, {}, {}}, {{}, {1}, {}}};
  if (time == model::TimeScheme::leapfrog) return {{{0, 2}, {1}}, {{1}, {}}};
  return {};
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
