// SPDX-License-Identifier: Apache-2.0
// From programs of kernels to rows, and the variants of the adjoint of steps that are made on the way.
#include <utility>

#include "adjoint/reverse/accumulating_adjoint.h"
#include "adjoint/reverse/kept.h"
#include "adjoint/reverse/newton_steps.h"
#include "driver/compile/pipeline.h"
#include "loop/from_stencil.h"
#include "stencil/passes/passes.h"

namespace dpde::driver {

StepToReverse step_to_reverse(const Compiled& compiled) {
  if (compiled.options.backend == Backend::interpreter) return {};  // the interpreter runs programs as written
  const auto found = compiled.derived.find(compiled.step_name());
  if (!compiled.problem || !compiled.problem->task || found == compiled.derived.end() || !found->second.adjoint)
    return {};
  const adjoint::Derivative& derivative = *found->second.adjoint;
  StepToReverse step{compiled.step_name(), derivative.program, {}};
  for (const model::Coefficient& coefficient : compiled.problem->coefficients) {
    if (const std::string* bar = derivative.field(coefficient.name)) step.gradients.push_back(*bar);
  }
  return step;
}

LoweredToLoop lower_to_loop(stencil::Module module, std::vector<std::string> programs, Precision real,
                            const StepToReverse& reversed, const loop::ParamValues& values) {
  std::vector<AdjointVariant> variants;
  module = adjoint::with_newton_steps(std::move(module));
  const auto storing = adjoint::add_storing_pair(reversed.step, reversed.adjoint, module);
  for (const stencil::Pass& pass : stencil::loop_passes) {
    // Regrouping rounds the weights of u + dt*(...) separately. They then do not add up to 1, and f32 states drift.
    if (real == Precision::f32 && pass.run == stencil::regroup_updates) continue;
    module = pass.run(module);
  }
  if (const auto name = adjoint::add_accumulating(reversed.adjoint, reversed.gradients, module)) {
    variants.push_back({*name, ""});
    programs.push_back(*name);
  }
  if (storing) {
    adjoint::accumulate(storing->adjoint, reversed.gradients, module);
    variants.push_back({storing->adjoint, storing->step});
    programs.insert(programs.end(), {storing->step, storing->adjoint});
  }
  return {loop::from_stencil(module, programs, real, values), variants};
}

void replace_loop(Compiled& compiled, loop::Module loop) {
  compiled.loop = std::move(loop);
  compiled.variants.clear();
}

}  // namespace dpde::driver
