// SPDX-License-Identifier: Apache-2.0
// What the tolerance of the solves in a step leaves in a gradient.
#pragma once

#include <memory>
#include <optional>

#include "analysis/certificate/certificate.h"

namespace dpde::analysis {

struct ToleranceEffect {
  double tolerance = 0;
  bool is_by_steps = false;  // a solve comes near step by step; of others all that is left is rounding
  double left = 0;           // of a right side, where a solve was stopped early by `or warn`; else 0
  double error = 0;          // of the gradient, relative
  double bound = 0;          // of it: with what the other gradient itself is in error by
  double reference = 0;      // the tolerance of the gradient that it was measured against; 0: it is an estimate
};

/// Where the task's steps solve equations. By how much the gradient at the start differs from that with all solves, of
/// states and adjoints, to 1e-13. Where the tolerance is not well above that: by how much it changes with a tolerance a
/// hundred times larger, over a hundred, as its error is linear in what is left of the solves. nullopt where nothing is
/// solved, or where that compares nothing. By the same line the gradient to 1e-13 is in error by at most a tenth of
/// what was measured (a hundredth, but for steps that go beyond a tolerance), so that 1.1 of it is a bound; of an
/// estimate it is the change itself. Solves that were stopped early are measured against ones that were not, by the
/// method that fits best.
std::optional<ToleranceEffect> effect_of_tolerance(const SourceFile& source,
                                                   const std::shared_ptr<const driver::Compiled>& compiled,
                                                   const CertifyOptions& options);

/// The same compilation with solves that go on to 1e-12, and are errors where they do not come there; of a problem.
/// What the text of a hand-written program says of its solves stays.
driver::CompileOptions with_solves_done(const driver::Compiled& compiled);
/// Whether the scheme has a tolerance above that, by which tangent and adjoint would differ. Solves that `warn` stops
/// early are none of these: certificates say what they leave.
bool has_loose_solves(const driver::Compiled& compiled);

}  // namespace dpde::analysis
