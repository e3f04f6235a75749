// SPDX-License-Identifier: Apache-2.0
// How fast small perturbations of a scene's states grow along its runs: a random tangent is carried with the states by
// the compiled tangent of the step and scaled back after each one; the mean of the logarithms over the second half of
// the steps, when the tangent has turned into the direction that grows fastest, is the leading exponent of Lyapunov
// (Benettin 1980).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "training/tests/trajectory_evaluator.h"

namespace dpde::training {

class GrowthScene {
 public:
  /// The scene of the task that `own` is compiled for, or with `scene` another one; with the tangent of its step and
  /// without the task. null when `sink` has errors afterwards.
  static std::unique_ptr<GrowthScene> open(const driver::Compiled& own, const std::string& scene,
                                           const SourceFile& source, DiagnosticSink& sink);

  /// One of each run, per unit of time; infinite where it blows up, and minus infinity where the tangent vanishes.
  /// `values` of unknowns as far as the scene has them.
  std::vector<double> rates(const files::Trajectories& on, int steps, const UnknownValues& values,
                            const BatchOptions& options) const;

 private:
  explicit GrowthScene(const SourceFile& source) : source_(source) {}

  const SourceFile& source_;
  std::shared_ptr<const driver::Compiled> compiled_;
};

}  // namespace dpde::training
