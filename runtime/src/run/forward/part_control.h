// SPDX-License-Identifier: Apache-2.0
// Lengths of substeps under a tolerance: chosen, recorded, and replayed. Inside the runtime only.
//
// The PI controller is close to that of DOPRI5, which lets steps grow tenfold and shortens rejected ones in another way
// (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4, and II, IV.2; Gustafsson 1991). With e the
// error over the tolerated one, of order k in the length h,
//   h_next = h*0.9*e^-(0.85/k)*e_before^(0.2/k), within h/5 and 5*h.
#pragma once

#include "dpde/runtime/rollout.h"

namespace dpde {

class PartControl {
 public:
  PartControl(double first_length, int order) : first_length_(first_length), order_(order) {}

  /// Starts at step `first`.
  void begin(int first);
  /// Replays `record`, which must stay valid; null: chooses lengths itself.
  void follow(const StepRecord* record) { followed_ = record; }
  /// The record in use: the followed one, or the own one.
  const StepRecord& parts() const { return followed_ != nullptr ? *followed_ : record_; }
  const StepController& state() const { return state_; }
  void set_state(const StepController& state) { state_ = state; }

  /// Length of the next substep, if `rest` of the step remains.
  double length(double rest) const;
  void accept(const PartOfStep& part, double error);
  void refuse(const PartOfStep& part, double error);
  /// Records a substep whatever its error.
  void record(const PartOfStep& part) { record_.parts.push_back(part); }
  void end_step() { record_.ends.push_back(record_.parts.size()); }
  size_t recorded() const { return record_.parts.size(); }

 private:
  double first_length_;
  int order_;
  StepRecord record_;
  const StepRecord* followed_ = nullptr;
  StepController state_;
};

}  // namespace dpde
