// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/newton_stages.h"

#include <memory>
#include <utility>

#include "stencil/build.h"
#include "stencil/lower/walls.h"

namespace dpde::stencil {

namespace {

/// The unknown on high walls where the boundary gives the value, elsewhere `value`.
Expr between_walls(const model::Problem& problem, const std::string& state, Expr value, const Expr& unknown) {
  const model::State* known = problem.find_state(state);
  for (const Offset& next : known == nullptr ? std::vector<Offset>{} : known_on_walls(*known, problem))
    value = select(inside(next, 0), value, unknown);
  return value;
}

constexpr double last_change = 1e-10;  // by quadratic convergence the error after this step is its square

/// The scheme's method if it is direct or bicgstab; other methods apply to the scheme's linear solves only.
SolveMethod method_of(const model::Scheme& scheme) {
  const SolveMethod method = scheme.solve.method;
  const bool fits = method == SolveMethod::direct || method == SolveMethod::bicgstab;
  return fits ? method : SolveMethod::automatic;
}

}  // namespace

std::vector<Stage> newton_stages(Lowering& lowering, const std::string& name,
                                 const std::vector<NewtonEquation>& equations, Environment reading) {
  Solve solve{{}, {}, {}, {}, {method_of(lowering.problem().scheme), last_change}, {}, false};
  if (!equations.empty()) solve.written.range = equations.front().origin.range;
  Kernel trial = lowering.kernel(name + "_trial"), left = lowering.kernel(name + "_left");
  for (const NewtonEquation& equation : equations) {
    const std::string copy = lowering.field_beside(equation.state, "trial");
    reading.fields[equation.state] = copy;
    trial.stores.push_back({copy, false, access(equation.unknown), equation.origin});
    solve.unknowns.push_back(equation.unknown);
    solve.rights.push_back(equation.right);
  }
  const Expr time = reading.time;
  Discretiser at_point = lowering.discretiser(std::move(reading));
  for (const NewtonEquation& equation : equations) {
    const model::Placement placement = lowering.placement_of(equation.state);
    const Expr unknown = access(equation.unknown);
    Expr value = unknown;
    for (const auto& [factor, part] : equation.parts) value = value - scaled(factor, at_point(part, placement));
    solve.images.push_back(lowering.fresh_field(equation.state + "_left"));
    left.stores.push_back({solve.images.back(), false,
                           between_walls(lowering.problem(), equation.state, value, unknown), equation.origin});
  }
  std::vector<Stage> stages{{std::move(trial), time, {}}, Lowering::stage(std::move(left), at_point, time)};
  const auto block = std::make_shared<const StageBlock>(StageBlock{.end = time, .solve = std::move(solve)});
  for (Stage& stage : stages) stage.block = block;
  return stages;
}

}  // namespace dpde::stencil
