// SPDX-License-Identifier: Apache-2.0
// What runs of a chart are compared with at the end of the scene: its exact solution, or else a run on finer cells with
// shorter steps, together with one half as fine that says how far it can be trusted.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "model/error_norm.h"

namespace dpde::chart {

/// What is called the error of a run.
struct Measure {
  std::string state;
  model::ErrorNorm norm = model::ErrorNorm::l2;
  bool operator==(const Measure&) const = default;
};
/// "u", or "linf(u)" of another norm than l2.
std::string text_of(const Measure& measure);

/// A state at the end of a run.
struct FinalState {
  std::vector<model::Axis> axes;  // with the points of the state in the place of centres
  std::vector<double> values;
};
using FinalStates = std::map<std::string, FinalState>;

/// Of the last run of the session. Histories of time schemes are left out.
FinalStates final_states(driver::Session& session);
/// Of such values, one state of the rollout after the other.
FinalStates final_states(driver::Session& session, const std::vector<double>& values);

/// The state at the points of other axes of the same domain: by Lagrange's polynomials through six points an axis, one
/// -sided beside walls.
std::vector<double> at_points(const FinalState& state, const std::vector<model::Axis>& axes);

double norm_of(const std::vector<double>& values, model::ErrorNorm norm);
/// The norm of a - b over the root mean square of b, where that is not 0.
double relative_difference(const std::vector<double>& a, const std::vector<double>& b, model::ErrorNorm norm);

class Reference {
 public:
  enum class Kind { exact, finer_run } kind = Kind::exact;
  /// The scene gives it.
  Reference() = default;
  explicit Reference(std::string text) : text_(std::move(text)) {}
  /// `second` is the same with half as many cells and steps.
  Reference(FinalStates finest, FinalStates second, const std::vector<Measure>& measures, std::string text);

  /// By measure, over the root mean square of the reference; of the exact solution those that have one. No measures:
  /// all states.
  std::map<std::string, double> errors(driver::Session& session, const std::vector<Measure>& measures) const;
  /// The reference's own error is about as large; 0 of the exact solution.
  double uncertainty() const { return uncertainty_; }
  /// It is known no better than this.
  void doubt(double uncertainty) { uncertainty_ = std::max(uncertainty_, uncertainty); }
  const std::string& text() const { return text_; }

 private:
  FinalStates finest_;
  double uncertainty_ = 0;
  std::string text_ = "the scene's exact solution";
};

}  // namespace dpde::chart
