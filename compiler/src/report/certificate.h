// SPDX-License-Identifier: Apache-2.0
// What `dpde verify` says of a certificate.
#pragma once

#include <string>

#include "analysis/certificate/certificate.h"
#include "analysis/certificate/solve_tolerance.h"
#include "driver/compile/pipeline.h"
#include "report/report.h"

namespace dpde::report {

/// `target`: "task recover"; `compiled`: what was certified, in f64 where the scene is one of f32.
Report report_of_certificate(const std::string& target, const analysis::Certificate& certificate,
                             const driver::Compiled& compiled);
/// In a few words why it is passed or not.
std::string reason_of(const analysis::Certificate& certificate);
/// What the tolerance of solves leaves in the gradient; `is_tighter`: the certificate is of others.
Report report_of_tolerance(const analysis::ToleranceEffect& effect, bool is_tighter);

}  // namespace dpde::report
