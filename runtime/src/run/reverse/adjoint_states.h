// SPDX-License-Identifier: Apache-2.0
// The adjoints of the states at one time, and of those a step earlier. Inside the runtime only.
#pragma once

#include <array>
#include <vector>

#include "base/reversal.h"
#include "dpde/runtime/rollout.h"
#include "run/run_memory.h"

namespace dpde {

class AdjointStates {
 public:
  AdjointStates(const RolloutSetup& setup, size_t states) : setup_(setup), states_(states) {}
  /// For states that are `over`, results share the memory of seeds.
  void allocate(RunMemory& memory, const std::vector<char>& over);

  void begin() { seeds_ = 0; }
  /// Input of the adjoint of a step, and its output.
  const StateBuffer& seeds() const { return buffers_[seeds_]; }
  const StateBuffer& results() const { return buffers_[1 - seeds_]; }
  /// Buffer for values to be added to the seeds.
  const StateBuffer& spare() const { return buffers_[2]; }
  /// Makes the results the seeds of the previous step.
  void swap() { seeds_ = 1 - seeds_; }
  size_t count() const { return states_; }

  /// Clears the seeds, of all states or of one.
  void zero() const;
  void zero(size_t state) const;
  /// Adds spare() to the seeds of a state.
  void add_spare(size_t state) const;
  /// 2-norm of the seeds, over all states and cells.
  double norm() const;

 private:
  const RolloutSetup& setup_;
  size_t states_;
  FieldPool pool_;
  std::array<StateBuffer, 3> buffers_;
  size_t seeds_ = 0;
};

}  // namespace dpde
