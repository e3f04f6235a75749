// SPDX-License-Identifier: Apache-2.0
// Looks up every name of every program of a rollout, once. A missing one is an error with its name. Inside the runtime
// only.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "run/bound_program.h"
#include "run/reverse/gradient_sums.h"
#include "run/run_memory.h"

namespace dpde {

class Binder {
 public:
  Binder(const ResolvedSetup& setup, const StateIds& states, RunMemory& memory, GradientSums& sums)
      : setup_(setup),
        states_(states),
        memory_(memory),
        sums_(sums),
        solvers_(setup.solvers ? setup.solvers : make_solver_store()) {}

  /// The first step that is bound defines for which states steps keep halos filled. `own`: results that the caller
  /// binds.
  BoundStep bind_step(const dpde_program& program, std::vector<ValueId> own = {});
  BoundRate bind_rate();
  /// `own`: fields that the caller binds.
  BoundAdjoint bind_adjoint(const dpde_program& program, std::vector<ValueId> own = {});
  /// For loss `number` of the setup.
  BoundTerm bind_term(size_t number);

 private:
  BoundProgram bind(const dpde_program& program, std::vector<ValueId> own, bool is_step = false);
  void bind_inputs(BoundProgram& bound, const std::vector<ValueId>& own);
  void bind_params(BoundProgram& bound) const;
  BoundLossAdjoint bind_loss_adjoint(size_t number, std::vector<ValueId> own);
  std::vector<BoundData> bind_data(size_t number, BoundProgram& bound) const;

  const ResolvedSetup& setup_;
  const StateIds& states_;
  RunMemory& memory_;
  GradientSums& sums_;
  std::shared_ptr<SolverStore> solvers_;  // shared by all programs
  std::vector<char> filled_;              // of each state: whether steps fill its halo
};

}  // namespace dpde
