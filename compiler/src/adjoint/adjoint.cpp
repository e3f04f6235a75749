// SPDX-License-Identifier: Apache-2.0
// Reverse mode of a program: the recomputed statements, then the transposes of all statements, last first.
#include "adjoint/adjoint.h"

#include <algorithm>

#include "adjoint/check/custom_adjoint_check.h"
#include "adjoint/reverse/plan.h"
#include "adjoint/reverse/reversal.h"
#include "stencil/analyse/effects.h"
#include "stencil/text/as_written.h"
#include "support/assert.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// The adjoint, with custom adjoints used unchecked.
Derivative reverse(const Module& module, const std::string& name, const Activity& wrt, DiagnosticSink& sink) {
  const Program* program = module.find_program(name);
  require(program != nullptr, "adjoint of a program that is not in the module");
  const Varied varied = find_varied(module, *program, wrt);
  if (!check_differentiable(module, *program, varied, Way::reverse, sink) ||
      !check_folds(module, *program, varied, sink))
    return {};

  DerivedNames names(module, "_bar");
  Derivative result{{}, names.fresh_program(name + "_adjoint"), {}, true};
  Module reverse_kernels;
  Reversal reversal(module, *program, varied, names, reverse_kernels, sink);
  reversal.reverse_all();
  std::set<std::string> inputs = wrt.fields;
  for (const Swap& swap : program->swaps) {
    if (varied.fields.contains(swap.state)) inputs.insert(swap.state);
  }
  reversal.finish(inputs);
  reversal.restore_seed_names();
  for (const auto& [kernel, what] : reversal.refused) {
    sink.report("no-useful-derivative", place_of(module, kernel),
                {what, "in kernel " + as_written(module, *program, kernel)},
                "store what is read in a field that is filled, and read that one without grow");
  }
  Program derived{result.program, program->axes, reversal.statements(result.module), {}, {}};
  if (!check_overwritten(module, *program, reversal.needed, sink)) return {};
  if (!reversal.refused.empty() || reversal.has_failed) return {};

  for (Kernel& kernel : reverse_kernels.kernels) {
    if (!result.module.find_kernel(kernel.name)) result.module.kernels.push_back(std::move(kernel));
  }
  add_results(*program, varied, wrt, names, derived);
  for (const std::string& network : parts_of({derived}).networks)
    add_networks(result.module, {*module.find_network(network)});
  result.module.programs.push_back(std::move(derived));
  for (const std::string& p : wrt.params) names.of(p);
  result.links = names.links(module, *program, wrt);
  return result;
}

}  // namespace

Derivative adjoint(const Module& module, const std::string& name, const Activity& wrt, DiagnosticSink& sink,
                   const Surroundings& surroundings) {
  const Program* program = module.find_program(name);
  require(program != nullptr, "adjoint of a program that is not in the module");
  if (!check_given(module, *program, find_varied(module, *program, wrt), reverse, surroundings, sink)) return {};
  return reverse(module, name, wrt, sink);
}

}  // namespace dpde::adjoint
