// SPDX-License-Identifier: Apache-2.0
// The lengths of the parts of steps under a tolerance: chosen, recorded, and read again. Inside the runtime only.
//
// The controller is nearly that of DOPRI5, which lets parts grow tenfold and shortens refused ones otherwise (Hairer,
// Norsett, Wanner, Solving Ordinary Differential Equations I, II.4, and II, IV.2; Gustafsson 1991): with e the error
// over what is tolerated, of the order k in the length h,
//   h_next = h*0.9*e^-(0.85/k)*e_before^(0.2/k), within h/5 and 5*h.
#pragma once

#include "dpde/runtime/rollout.h"

namespace dpde {

class PartControl {
 public:
  PartControl(double first_length, int order) : first_length_(first_length), order_(order) {}

  /// From step `first` on.
  void begin(int first);
  /// Null: what is chosen here. What it points to must stay.
  void follow(const StepRecord* record) { followed_ = record; }
  /// What counts: of the record that is followed, or of the own one.
  const StepRecord& parts() const { return followed_ != nullptr ? *followed_ : record_; }
  const StepController& state() const { return state_; }
  void set_state(const StepController& state) { state_ = state; }

  /// Of the next part, where `rest` is left of the step.
  double length(double rest) const;
  void accept(const PartOfStep& part, double error);
  void refuse(const PartOfStep& part, double error);
  /// Whatever its error is.
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
