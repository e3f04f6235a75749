// SPDX-License-Identifier: Apache-2.0
// The adjoint of a step may read states only through a few values that the step computes anyway. The gradient of a wave
// by c in dt(dt(u)) = c*lap(u) reads u at every point of lap, but nothing else than lap(u). If the step stores these
// values, one field for each state that is no longer read, the adjoint evaluates one stencil instead of two, and as
// many fields are stored.
#pragma once

#include <optional>
#include <string>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// The step that also stores the values, and the adjoint that reads them in place of states, under the same names.
struct StoringPair {
  std::string step, adjoint;
};

/// Adds both programs. nullopt, and nothing is added, if that saves less than a stencil of 13 points, or if the step
/// does not compute these values.
std::optional<StoringPair> add_storing_pair(const std::string& step, const std::string& adjoint,
                                            stencil::Module& module);

}  // namespace dpde::adjoint
