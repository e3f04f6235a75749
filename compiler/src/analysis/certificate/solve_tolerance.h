// SPDX-License-Identifier: Apache-2.0
// Effect of the tolerance of a step's solves on a gradient.
#pragma once

#include <memory>
#include <optional>

#include "analysis/certificate/certificate.h"

namespace dpde::analysis {

struct ToleranceEffect {
  double tolerance = 0;
  bool is_by_steps = false;  // a solve is iterative; other solves leave only rounding
  double left = 0;           // relative residual of a solve stopped early by `or warn`; else 0
  double error = 0;          // relative error of the gradient
  double bound = 0;          // bound of it, which includes the error of the reference
  double reference = 0;      // tolerance of the reference gradient; 0: `error` is an estimate
};

/// For tasks whose steps solve equations. Difference of the gradient at the start from that with all solves, of states
/// and adjoints, to 1e-13. If the tolerance is not well above that: its change for a tolerance a hundred times larger,
/// divided by hundred, since the error is linear in the residuals. nullopt if nothing is solved or comparable. By the
/// same linearity the error of the reference is at most a tenth of the measured one (a hundredth, except for methods
/// that overshoot their tolerance). So 1.1 times the error is a bound; for an estimate the bound is the change itself.
/// Solves that were stopped early are compared with completed ones, by the best method.
std::optional<ToleranceEffect> effect_of_tolerance(const SourceFile& source,
                                                   const std::shared_ptr<const driver::Compiled>& compiled,
                                                   const CertifyOptions& options);

/// The same compilation with solves to 1e-12, which are errors if they do not converge. Requires a problem. Settings of
/// solves in the text of hand-written programs are not changed.
driver::CompileOptions with_solves_done(const driver::Compiled& compiled);
/// Whether the scheme's tolerance is larger than that, so that tangent and adjoint differ. Solves stopped early by
/// `warn` do not count: certificates report their residuals.
bool has_loose_solves(const driver::Compiled& compiled);

}  // namespace dpde::analysis
