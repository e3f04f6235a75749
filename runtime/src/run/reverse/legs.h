// SPDX-License-Identifier: Apache-2.0
// A gradient runs in legs, forward and backward. A leg leads from one state to the next: one step or a block of steps.
// A block begins at a stored state and ends at the next one. Losses are only at its ends, and control fields do not
// change in it. Inside the runtime only.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "run/reverse/loss_seeds.h"
#include "run/reverse/step_adjoint.h"
#include "wavefront/wavefront.h"

namespace dpde {

class Legs {
 public:
  Legs(const RolloutSetup& setup, const StepInputs& inputs, Stepper& stepper, Losses& losses, GradientSums& sums,
       AdjointStates& bars, StepAdjoint& adjoint, LossSeeds& seeds)
      : setup_(setup),
        inputs_(inputs),
        stepper_(stepper),
        losses_(losses),
        sums_(sums),
        bars_(bars),
        adjoint_(adjoint),
        seeds_(seeds) {}

  /// Plans blocks if they save stored states; useful only if `states_are_stored`.
  void plan(bool states_are_stored);

  int count() const { return marks_.empty() ? losses_.last() : static_cast<int>(marks_.size()) - 1; }
  /// A leg leads from state mark(leg) to state mark(leg + 1).
  int mark(int leg) const { return marks_.empty() ? leg : marks_[static_cast<size_t>(leg)]; }
  int steps_of(int leg) const { return mark(leg + 1) - mark(leg); }
  /// 1: all legs are single steps.
  int block_steps() const { return block_ ? block_->adjoint.steps() : 1; }

  void run(int leg, const StateBuffer& from, const StateBuffer& to);
  /// Runs the adjoints of the steps of a leg, and adds the losses at its first state, which is `state`.
  void reverse(int leg, const StateBuffer& state);
  /// After the adjoint of step n: adds the losses at its first state, which is `state`.
  void add_losses(int n, const StateBuffer& state);

 private:
  struct Block {
    Wavefront step, adjoint;
    std::vector<size_t> results_of;  // of each swap of the adjoint: index of the state
    std::vector<void*> results;
    std::vector<double*> totals;  // sums of the unknown fields, in the intervals of the leg
  };
  std::optional<Block> make_block(int steps, bool chooses) const;
  bool plan_marks(int steps);
  void reverse_block(int n, const StateBuffer& state, bool new_seeds);

  const RolloutSetup& setup_;
  const StepInputs& inputs_;
  Stepper& stepper_;
  Losses& losses_;
  GradientSums& sums_;
  AdjointStates& bars_;
  StepAdjoint& adjoint_;
  LossSeeds& seeds_;
  std::vector<int> marks_;
  std::optional<Block> block_;
};

}  // namespace dpde
