// SPDX-License-Identifier: Apache-2.0
// The gradient of a task's loss in a form in which grids can be compared: by fields it is taken over the volume of each
// cell, which is the derivative by the function that the field stands for, and has its points as states do.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "chart/reference.h"
#include "driver/scene/inverse.h"
#include "driver/scene/session.h"

namespace dpde::chart {

struct GradientPart {
  std::vector<model::Axis> axes;  // of a field: its points in the place of centres; else none
  std::vector<double> values;     // of a field over cell volumes, one interval of a control field after the other
};
/// By unknown.
using GradientParts = std::map<std::string, GradientPart>;

/// A task of a scene where it begins.
class TaskGradient {
 public:
  /// null where `why` says why not. `session` was compiled with the task and its adjoint.
  static std::unique_ptr<TaskGradient> open(std::unique_ptr<driver::Session> session, const SourceFile& source,
                                            std::string& why);

  /// One value and gradient; false where it was stopped.
  bool run();
  /// Of the last run, one unknown after the other.
  std::vector<double> values() const { return {gradient_.data(), gradient_.data() + gradient_.size()}; }
  /// Of such values.
  GradientParts parts(const std::vector<double>& values) const;
  bool is_finite() const;
  driver::Session& session() { return *session_; }
  /// At the peak of a run.
  double memory_bytes(const SourceFile& source) const;

 private:
  std::unique_ptr<driver::Session> session_;
  std::unique_ptr<driver::Inverse> inverse_;
  Eigen::VectorXd gradient_;
  double loss_ = 0;
};

class GradientReference {
 public:
  GradientReference() = default;
  /// `second` is the same with half as many cells and steps.
  GradientReference(GradientParts finest, const GradientParts& second, std::string text);

  /// Relative root mean square differences by unknown; of those that cannot be compared none.
  std::map<std::string, double> errors(const GradientParts& parts) const;
  double uncertainty() const { return uncertainty_; }
  const std::string& text() const { return text_; }
  bool is_there() const { return !finest_.empty(); }

 private:
  GradientParts finest_;
  double uncertainty_ = 0;
  std::string text_;
};

}  // namespace dpde::chart
