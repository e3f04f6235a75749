// SPDX-License-Identifier: Apache-2.0
#include "chart/common_steps.h"

#include <cmath>
#include <numeric>

namespace dpde::chart {

namespace {

int with_times(int common, const model::Problem& problem, const model::When& when) {
  if (when.kind != model::When::Kind::at) return common;
  for (const double t : when.times)
    common = std::gcd(common, static_cast<int>(std::lround((t - problem.t_begin) / problem.step)));
  return common;
}

}  // namespace

int common_steps(const model::Problem& problem) {
  int common = problem.steps;
  for (const model::Output& output : problem.outputs) common = std::gcd(common, output.every);
  for (const model::Control& control : problem.controls) common = std::gcd(common, control.every);
  for (const model::Coefficient& coefficient : problem.coefficients) common = std::gcd(common, coefficient.every);
  for (const model::Event& event : problem.events) {
    common = std::gcd(common, event.every);
    for (const int step : event.at) common = std::gcd(common, step);
  }
  if (!problem.task) return common;
  for (const model::Loss& loss : problem.task->losses) common = with_times(common, problem, loss.when);
  for (const model::Test& test : problem.task->tests) common = with_times(common, problem, test.when);
  for (const model::Datum& datum : problem.task->data) common = with_times(common, problem, datum.when);
  return common;
}

}  // namespace dpde::chart
