// SPDX-License-Identifier: Apache-2.0
// The gradient of a task's loss in a form that can be compared between grids. For fields it is divided by the cell
// volumes, which gives the functional derivative, at the same points as states.
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
  std::vector<model::Axis> axes;  // for a field: its points as cell centres; else empty
  std::vector<double> values;     // for a field divided by cell volumes; control fields interval after interval
};
/// By name of the unknown.
using GradientParts = std::map<std::string, GradientPart>;

/// A task of a scene, at its start.
class TaskGradient {
 public:
  /// Returns null on failure, with the reason in `why`. `session` must be compiled with the task and its adjoint.
  static std::unique_ptr<TaskGradient> open(std::unique_ptr<driver::Session> session, const SourceFile& source,
                                            std::string& why);

  /// Computes value and gradient; returns false if it was stopped.
  bool run();
  /// Result of the last run, one unknown after the other.
  std::vector<double> values() const { return {gradient_.data(), gradient_.data() + gradient_.size()}; }
  /// Splits such values into parts.
  GradientParts parts(const std::vector<double>& values) const;
  bool is_finite() const;
  driver::Session& session() { return *session_; }
  /// Peak memory of a run.
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
  /// `second`: the result with half as many cells and steps.
  GradientReference(GradientParts finest, const GradientParts& second, std::string text);

  /// Relative RMS differences by unknown, for those that can be compared.
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
