// SPDX-License-Identifier: Apache-2.0
// Looks up every name of every program of a rollout, once; everything that is missing is an error that names it.
// Inside the runtime only.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "run/bound_program.h"
#include "run/gradient_sums.h"
#include "run/run_memory.h"

namespace dpde {

class Binder {
 public:
  Binder(const RolloutSetup& setup, const StateNames& names, RunMemory& memory, GradientSums& sums)
      : setup_(setup),
        names_(names),
        memory_(memory),
        sums_(sums),
        solvers_(setup.solvers ? setup.solvers : make_solver_store()) {}

  /// The first one says which halos of states steps keep filled. `own`: results that are bound by whoever calls this.
  BoundStep bind_step(const dpde_program& program, std::vector<std::string> own = {});
  BoundRate bind_rate();
  /// `own`: fields that are bound by whoever calls this.
  BoundAdjoint bind_adjoint(const dpde_program& program, std::vector<std::string> own = {});
  /// `average`: the number of what it adds to; -1: the loss.
  BoundTerm bind_term(const LossTerm& term, int average);
  /// A parameter that the losses of averages set.
  void add_average(std::string name) { averages_.push_back(std::move(name)); }

 private:
  BoundProgram bind(const dpde_program& program, std::vector<std::string> own, bool is_step = false);
  void bind_inputs(BoundProgram& bound, const std::vector<std::string>& own);
  void bind_params(BoundProgram& bound) const;
  BoundLossAdjoint bind_loss_adjoint(const LossTerm& term, std::vector<std::string> own);
  std::vector<BoundData> bind_data(const LossTerm& term, BoundProgram& bound) const;

  const RolloutSetup& setup_;
  const StateNames& names_;
  RunMemory& memory_;
  GradientSums& sums_;
  std::shared_ptr<SolverStore> solvers_;  // of all programs
  std::vector<char> filled_;              // of each state: whether steps fill its halo
  std::vector<std::string> averages_;
};

}  // namespace dpde
