// SPDX-License-Identifier: Apache-2.0
// Report of a certificate, for `dpde verify`.
#pragma once

#include <string>

#include "analysis/certificate/certificate.h"
#include "analysis/certificate/solve_tolerance.h"
#include "driver/compile/pipeline.h"
#include "report/report.h"

namespace dpde::report {

/// `target`: "task recover"; `compiled`: what was certified, in f64 for a scene in f32.
Report report_of_certificate(const std::string& target, const analysis::Certificate& certificate,
                             const driver::Compiled& compiled);
/// Short reason of the verdict.
std::string reason_of(const analysis::Certificate& certificate);
/// Effect of the solves' tolerance on the gradient; `is_tighter`: the certificate is for a smaller tolerance.
Report report_of_tolerance(const analysis::ToleranceEffect& effect, bool is_tighter);

}  // namespace dpde::report
