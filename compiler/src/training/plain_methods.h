// SPDX-License-Identifier: Apache-2.0
// The plain methods that a network is measured by: not only the ones that a person named (McGreivy and Hakim 2024: most
// comparisons are with a weak baseline).
#pragma once

#include <string>
#include <vector>

#include "chart/point.h"
#include "training/window_batches.h"

namespace dpde::training {

struct PlainMethods {
  /// Tests that are a number and have scenes beside them; beside each plain scene, it by the methods that suit its
  /// equations, with the steps that charts give these (chart::entries_on): parts of the largest stable step, the frames
  /// of its file at their ends; where none is known, its own. What a scene with the same data has already is left out.
  std::vector<model::Test> tests;
  /// "plain by advect=weno5: why", of those that do not compile, or are unstable at every step.
  std::vector<std::string> left_out;
};
PlainMethods with_plain_methods(const TrainingScene& own, const SourceFile& source);

}  // namespace dpde::training
