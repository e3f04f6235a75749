// SPDX-License-Identifier: Apache-2.0
// Reference runs: refined until two agree; each is cached by its inputs.
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "chart/point.h"

namespace dpde::chart {

/// Factors are relative to the scene's cells along each axis, and double from run to run.
struct Refinement {
  double first = 1;                                               // the second run has twice as many cells
  double most = 2;                                                // maximum for all but the second run
  double enough = std::numeric_limits<double>::infinity();        // no further refinement below this uncertainty
  double most_seconds = std::numeric_limits<double>::infinity();  // maximum of a run, predicted from earlier ones
};

/// Runs with central differences of order 6 and rk4 if these are suitable and stable, else with the scene's own scheme.
/// Of the last two runs one is the reference, and the other gives its uncertainty. nullopt and `why` if no reference is
/// possible.
std::optional<Reference> make_reference(const SourceFile& source, const PointOptions& options,
                                        const model::Problem& scene, const Refinement& refinement, std::string& why);
/// The same for the gradient of the options' task.
std::optional<GradientReference> make_gradient_reference(const SourceFile& source, const PointOptions& options,
                                                         const model::Problem& scene, const Refinement& refinement,
                                                         std::string& why);

}  // namespace dpde::chart
