// SPDX-License-Identifier: Apache-2.0
// Report of the largest stable step of a scene.
#pragma once

#include "report/report.h"
#include "source/source_file.h"
#include "stability/stability_report.h"

namespace dpde::report {

/// One line or more. The JSON is the object `stability` of dpde check.
Report verdict_report(const model::Problem& problem, const stability::StabilityReport& verdict,
                      const SourceFile& source);

}  // namespace dpde::report
