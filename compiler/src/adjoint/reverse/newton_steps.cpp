// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/newton_steps.h"

#include "adjoint/solves.h"
#include "stencil/analyse/effects.h"
#include "stencil/passes/passes.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

class NewtonSteps {
 public:
  explicit NewtonSteps(Module& module) : module_(module) {}

  void add_to(std::vector<Statement>& statements, const Program& program) {
    for (Statement& statement : statements) {  // nested solves first: the step is built from the block
      for_each_block(statement, Blocks::all, [&](auto& block) { add_to(block, program); });
      match_some(statement, [&](Solve& solve) {
        if (!solve.is_linear && solve.step.empty()) solve.step = {step_of(solve, program)};
      });
    }
  }

 private:
  Solve step_of(const Solve& solve, const Program& program) {
    DerivedNames names(module_, "_step");
    Module kernels;
    std::vector<std::string> changes, rights;
    for (const std::string& unknown : solve.unknowns) changes.push_back(names.fresh(unknown + "_change"));
    for (const std::string& unknown : solve.unknowns) rights.push_back(names.fresh(unknown + "_left"));
    Solve step = linearised(module_, program, solve, changes, names, kernels);
    step.rights = std::move(rights);
    kernels.programs.push_back(operator_of(step, program));
    kernels = remove_dead_code(kernels);  // statements that only the block itself needs
    step.body = kernels.programs.front().body;
    for (Kernel& kernel : kernels.kernels) {
      if (!module_.find_kernel(kernel.name)) module_.kernels.push_back(std::move(kernel));
    }
    return step;
  }

  Module& module_;
};

}  // namespace

Module with_newton_steps(Module module) {
  std::vector<Program> programs = module.programs;
  NewtonSteps steps(module);
  for (Program& program : programs) {
    const Program before = program;
    steps.add_to(program.body, before);
  }
  module.programs = std::move(programs);
  return module;
}

}  // namespace dpde::adjoint
