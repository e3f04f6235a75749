// SPDX-License-Identifier: Apache-2.0
// What the adjoints of the losses at a state say: seeds of its adjoint, and shares of the sums. Inside the runtime
// only.
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

  /// Sets the seeds: the losses of the last step that has some, at `state`, which is the state k.
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
