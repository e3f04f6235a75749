// SPDX-License-Identifier: Apache-2.0
// Leading Lyapunov exponent along a scene's runs. The compiled tangent of the step propagates a random tangent with the
// states; it is rescaled after each step. The exponent is the mean of the logarithms over the second half of the steps,
// when the tangent points in the fastest growing direction (Benettin 1980).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "training/tests/trajectory_evaluator.h"

namespace dpde::training {

class GrowthScene {
 public:
  /// Opens the scene of the task that `own` is compiled for, or the scene `scene`, with the tangent of its step and
  /// without the task. Returns null if `sink` has errors afterwards.
  static std::unique_ptr<GrowthScene> open(const driver::Compiled& own, const std::string& scene,
                                           const SourceFile& source, DiagnosticSink& sink);

  /// Exponent of each run per unit of time; infinite if the run blows up, minus infinity if the tangent vanishes. Uses
  /// the `values` of those unknowns that the scene has.
  std::vector<double> rates(const files::Trajectories& on, int steps, const UnknownValues& values,
                            const BatchOptions& options) const;

 private:
  explicit GrowthScene(const SourceFile& source) : source_(source) {}

  const SourceFile& source_;
  std::shared_ptr<const driver::Compiled> compiled_;
};

}  // namespace dpde::training
