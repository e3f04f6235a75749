// SPDX-License-Identifier: Apache-2.0
// What the tolerance of the solves in a step leaves in a gradient.
#pragma once

#include <memory>
#include <optional>

#include "analysis/certificate.h"

namespace dpde::analysis {

struct ToleranceEffect {
  double tolerance = 0;
  bool is_by_steps = false;  // a solve comes near step by step; of others all that is left is rounding
  double error = 0;          // of the gradient, relative
};

/// Where the task's steps solve equations. By how much the gradient at the start changes where the tolerance is a
/// hundred times larger, over a hundred: what is left of each solve is at most its tolerance, and the gradient's error
/// is linear in that. nullopt where nothing is solved, or where that compares nothing.
std::optional<ToleranceEffect> effect_of_tolerance(const SourceFile& source,
                                                   const std::shared_ptr<const driver::Compiled>& compiled,
                                                   const CertifyOptions& options);

}  // namespace dpde::analysis
