// SPDX-License-Identifier: Apache-2.0
// References that are runs: finer and finer ones until two agree, each kept in the cache by what it is made of.
#pragma once

#include <limits>
#include <optional>
#include <string>

#include "chart/point.h"

namespace dpde::chart {

/// Factors are of the scene's cells along each axis, and double from run to run.
struct Refinement {
  double first = 1;                                               // the second run has twice as many
  double most = 2;                                                // no run has more, but for the second one
  double enough = std::numeric_limits<double>::infinity();        // the uncertainty that no finer run is made below
  double most_seconds = std::numeric_limits<double>::infinity();  // that a run may take, by those before it
};

/// Runs by central differences of order 6 and rk4 where these fit and are stable, else by the scene's own scheme. Of
/// the last two one is the reference and the other tells how well it is known. nullopt, and why, where none can be
/// made.
std::optional<Reference> make_reference(const SourceFile& source, const PointOptions& options,
                                        const model::Problem& scene, const Refinement& refinement, std::string& why);
/// The same of the gradient of the options' task.
std::optional<GradientReference> make_gradient_reference(const SourceFile& source, const PointOptions& options,
                                                         const model::Problem& scene, const Refinement& refinement,
                                                         std::string& why);

}  // namespace dpde::chart
