// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/surroundings.h"

namespace dpde::driver {

adjoint::Surroundings surroundings_of(const Compiled& compiled) {
  adjoint::Surroundings result;
  if (!compiled.problem) return result;
  const model::Problem& problem = *compiled.problem;
  for (const model::Axis& axis : problem.axes) result.axes.push_back({axis.cells, axis.low, axis.spacing()});
  for (const model::Parameter& parameter : problem.params) result.params[parameter.name] = parameter.value;
  result.params["dt"] = problem.step;
  result.params["t"] = problem.t_begin + problem.steps / 2 * problem.step;
  return result;
}

}  // namespace dpde::driver
