// SPDX-License-Identifier: Apache-2.0
// What runs of a chart are compared with at the end of the scene: its exact solution, or else a run on finer cells with
// shorter steps, together with one half as fine that says how far it can be trusted.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/session.h"

namespace dpde::chart {

/// A state at the end of a run.
struct FinalState {
  std::vector<model::Axis> axes;  // with the points of the state in the place of centres
  std::vector<double> values;
};
using FinalStates = std::map<std::string, FinalState>;

/// Of the last run of the session. Histories of time schemes are left out.
FinalStates final_states(driver::Session& session);

/// The state at the points of other axes of the same domain: by Lagrange's polynomials through six points an axis, one
/// -sided beside walls.
std::vector<double> at_points(const FinalState& state, const std::vector<model::Axis>& axes);

class Reference {
 public:
  enum class Kind { exact, finer_run } kind = Kind::exact;
  /// The scene gives it.
  Reference() = default;
  /// `second` is the same with half as many cells and steps.
  Reference(FinalStates finest, FinalStates second, std::string text);

  /// Relative root mean square differences by state; of the exact solution those that have one.
  std::map<std::string, double> errors(driver::Session& session) const;
  /// The reference's own error is about as large; 0 of the exact solution.
  double uncertainty() const { return uncertainty_; }
  const std::string& text() const { return text_; }

 private:
  FinalStates finest_;
  double uncertainty_ = 0;
  std::string text_ = "the scene's exact solution";
};

}  // namespace dpde::chart
