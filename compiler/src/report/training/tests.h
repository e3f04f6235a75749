// SPDX-License-Identifier: Apache-2.0
// Report of a training's tests: text, tables, curves and JSON.
#pragma once

#include <string>

#include "report/report.h"
#include "training/tests/test_results.h"
#include "training/tests/trajectory_test.h"

namespace dpde::report {

/// JSON keys test, statistic, spectrum and correlation. Only an empty `test` if a data file disappeared since the
/// training began.
Report tests_report(const training::TestResults& results);
/// JSON key growth; omitted if there are no such tests.
Report growths_report(const training::GrowthResults& results);

/// Learnt weights are used in all scenes and override weight files that compared scenes name. Warnings of such files,
/// one line for each.
std::string weights_not_used_text(const training::TestScenes& scenes);

}  // namespace dpde::report
