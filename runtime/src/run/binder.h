// SPDX-License-Identifier: Apache-2.0
// Looks up every name of every program of a rollout, once; everything that is missing is an error that names it.
// Inside the runtime only.
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

  /// The first one says which halos of states steps keep filled. `own`: results that are bound by whoever calls this.
  BoundStep bind_step(const dpde_program& program, std::vector<ValueId> own = {});
  BoundRate bind_rate();
  /// `own`: fields that are bound by whoever calls this.
  BoundAdjoint bind_adjoint(const dpde_program& program, std::vector<ValueId> own = {});
  /// Of the losses of the setup.
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
  std::shared_ptr<SolverStore> solvers_;  // of all programs
  std::vector<char> filled_;              // of each state: whether steps fill its halo
};

}  // namespace dpde
