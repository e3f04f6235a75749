// SPDX-License-Identifier: Apache-2.0
// Adjoints of the losses at a state: seeds of its adjoint, and contributions to the sums. Inside the runtime only.
#pragma once

#include <vector>

#include "run/forward/step_inputs.h"
#include "run/losses.h"
#include "run/reverse/adjoint_states.h"
#include "run/reverse/gradient_sums.h"

namespace dpde {

class LossSeeds {
 public:
  LossSeeds(const StepInputs& inputs, Losses& losses, GradientSums& sums, AdjointStates& bars)
      : inputs_(inputs), losses_(losses), sums_(sums), bars_(bars), is_seeded_(bars.count(), 0) {}

  /// Sets the seeds from the losses at the last step with a loss: `state` is state k.
  void set(int k, const StateBuffer& state);
  /// Adds the derivative of the losses at state k to the seeds.
  void add(int k, const StateBuffer& state);

 private:
  void seed_averages();
  void run(const LossEvent& event, int k, const StateBuffer& state);

  const StepInputs& inputs_;
  Losses& losses_;
  GradientSums& sums_;
  AdjointStates& bars_;
  std::vector<char> is_seeded_;  // of each state
};

}  // namespace dpde
