// SPDX-License-Identifier: Apache-2.0
// Reference for the runs of a chart at the end of the scene: its exact solution, or a finer run together with one of
// half its resolution, which gives its uncertainty.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "model/error_norm.h"

namespace dpde::chart {

/// An error measure of a run.
struct Measure {
  std::string state;
  model::ErrorNorm norm = model::ErrorNorm::l2;
  bool operator==(const Measure&) const = default;
};
/// "u", or "linf(u)" for norms other than l2.
std::string text_of(const Measure& measure);

/// A state at the end of a run.
struct FinalState {
  std::vector<model::Axis> axes;  // with the points of the state as centres
  std::vector<double> values;
};
using FinalStates = std::map<std::string, FinalState>;

/// States of the session's last run, without histories of time schemes.
FinalStates final_states(driver::Session& session);
/// From such values, one state of the rollout after the other.
FinalStates final_states(driver::Session& session, const std::vector<double>& values);

/// The state at the points of other axes of the same domain, by Lagrange interpolation through six points along each
/// axis, one-sided near walls.
std::vector<double> at_points(const FinalState& state, const std::vector<model::Axis>& axes);

double norm_of(const std::vector<double>& values, model::ErrorNorm norm);
/// The norm of a - b relative to the RMS of b, if that is not 0.
double relative_difference(const std::vector<double>& a, const std::vector<double>& b, model::ErrorNorm norm);

class Reference {
 public:
  enum class Kind { exact, finer_run } kind = Kind::exact;
  /// For a scene with an exact solution.
  Reference() = default;
  explicit Reference(std::string text) : text_(std::move(text)) {}
  /// `second`: the result with half as many cells and steps.
  Reference(FinalStates finest, FinalStates second, const std::vector<Measure>& measures, std::string text);

  /// By measure, relative to the RMS of the reference; with an exact solution only states that have one. Without
  /// measures: all states.
  std::map<std::string, double> errors(driver::Session& session, const std::vector<Measure>& measures) const;
  /// Estimated error of the reference itself; 0 for an exact solution.
  double uncertainty() const { return uncertainty_; }
  /// Increases the uncertainty to at least this value.
  void doubt(double uncertainty) { uncertainty_ = std::max(uncertainty_, uncertainty); }
  const std::string& text() const { return text_; }

 private:
  FinalStates finest_;
  double uncertainty_ = 0;
  std::string text_ = "the scene's exact solution";
};

}  // namespace dpde::chart
