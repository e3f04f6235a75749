// SPDX-License-Identifier: Apache-2.0
// Plans how many states and tapes a gradient stores, and when it recomputes the others. Inside the runtime only.
#pragma once

#include <vector>

#include "base/reversal.h"
#include "run/reverse/tape_store.h"
#include "run/reverse/way_back.h"
#include "run/states.h"

namespace dpde {

class Trajectory {
 public:
  Trajectory(const ResolvedSetup& setup, const StateIds& states, const Losses& losses)
      : setup_(setup), states_(states), losses_(losses) {}

  /// Call once all programs are bound; also chooses the legs and the adjoint. `back` is null if no gradient is wanted.
  void plan(Stepper& stepper, Losses& losses, WayBack* back, Binder& binder, RunMemory& memory);

  /// False: the adjoints read only the last state.
  bool is_stored() const { return is_stored_; }
  const BufferPlan& buffers() const { return buffers_; }
  /// In addition to the initial state.
  int stored_states() const { return slots_ - 1; }
  /// Forward steps beyond the first pass.
  int64_t recomputed_steps() const { return recomputed_; }
  /// Bytes of checkpoints, without those between substeps.
  int64_t bytes() const { return bytes_; }
  Reversal& reversal() { return reversal_; }
  TapeStore& tapes() { return tapes_; }

 private:
  std::vector<char> states_read(const dpde_program& adjoint, const BoundProgram* rate) const;
  void plan_buffers(int slots, const std::vector<char>& read, const Legs* legs);
  int plan_slots(const std::vector<char>& read, const Legs& legs);
  int least_of_ranks(int64_t slots) const;
  int64_t count_recomputed(const Legs& legs) const;
  bool stores_less(const dpde_adjoint_variant& variant, const std::vector<char>& read, const BoundProgram* rate,
                   const Legs& legs) const;
  void plan_way_back(const BoundProgram* rate, WayBack& back, std::vector<char>& read, Binder& binder,
                     RunMemory& memory);
  void plan_tapes(Executor& step, Executor& adjoint, Losses& losses, int64_t left, bool is_plan);
  int64_t bytes_of_states(int64_t kept_fields) const;
  int64_t count() const { return std::ssize(states_.now); }

  const ResolvedSetup& setup_;
  const StateIds& states_;
  const Losses& losses_;
  bool is_stored_ = false;
  int slots_ = 1;
  BufferPlan buffers_;
  int64_t recomputed_ = 0, bytes_ = 0;
  Reversal reversal_;
  TapeStore tapes_;
};

}  // namespace dpde
