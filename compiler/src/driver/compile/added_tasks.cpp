// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/added_tasks.h"

#include <algorithm>
#include <string>
#include <utility>

#include "model/boundary/stretch.h"
#include "model/build.h"

namespace dpde::driver {

namespace {

/// Adds a datum with the placement of `state` to the task and returns it as a factor.
model::Expr add_weights(model::Task& task, const model::State& state, const char* ending,
                        const model::Problem& problem) {
  std::string name = state.name + ending;
  while (model::is_taken(problem, name)) name += "_";
  model::Datum& datum = task.data.emplace_back();
  datum.name = name;
  datum.placement = state.placement;
  return model::field(name);
}

}  // namespace

void add_certifying_task(model::Problem& problem) {
  constexpr int most_steps_until_steady = 20;  // enough to certify the steps; the steady state itself is not needed
  if (problem.steady > 0) problem.steps = std::min(problem.steps, most_steps_until_steady);
  problem.steady = 0;
  model::Task task;
  task.name = problem.scene + "_certificate";
  task.certifies = true;
  model::Expr total = 0.0;
  for (const model::State& state : problem.states) {
    const model::Expr u = model::field(state.name), probe = add_weights(task, state, "_probe", problem);
    const model::Expr square = model::binary(BinaryOp::multiply, model::binary(BinaryOp::multiply, 0.5, u), u);
    const model::Expr value = model::binary(BinaryOp::add, u, square);
    total = model::binary(BinaryOp::add, total, model::binary(BinaryOp::multiply, probe, value));
    task.unknowns.push_back({model::Unknown::Kind::initial, state.name, state.initial, {}});
  }
  task.losses.push_back({model::reduce(model::Reduce::Kind::sum, total), {}, {}});
  for (model::Parameter& param : problem.params) {
    const auto holds = [&](const model::Expr& e) {
      const model::Param* found = as<model::Param>(e);
      return found != nullptr && found->name == param.name;
    };
    param.unknown =
        std::none_of(problem.coefficients.begin(), problem.coefficients.end(),
                     [&](const model::Coefficient& c) { return c.value.formula && any_part(*c.value.formula, holds); });
    if (!param.unknown) continue;
    const auto control = std::ranges::find(problem.controls, param.name, &model::Control::name);
    if (control != problem.controls.end()) {
      control->start = control->values;
      task.unknowns.push_back({model::Unknown::Kind::control, param.name, {control->formula, "", {}}, {}});
    } else {
      task.unknowns.push_back({model::Unknown::Kind::parameter, param.name, {model::number(param.value), "", {}}, {}});
    }
  }
  problem.task = std::move(task);
}

void seed_the_end(model::Problem& problem) {
  model::Task& task = *problem.task;
  task.data.clear();
  task.losses.clear();
  model::Expr total = 0.0;
  for (const model::State& state : problem.states) {
    const model::Expr seed = add_weights(task, state, "_seed", problem);
    total = model::binary(BinaryOp::add, total, model::binary(BinaryOp::multiply, seed, model::field(state.name)));
  }
  task.losses.push_back({model::reduce(model::Reduce::Kind::sum, total), {}, {}});
}

}  // namespace dpde::driver
