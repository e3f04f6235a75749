// SPDX-License-Identifier: Apache-2.0
// What the tests of a training say: in words, as tables, curves and JSON.
#pragma once

#include "report/report.h"
#include "training/test_results.h"

namespace dpde::report {

/// The keys test, statistic, spectrum and correlation of the JSON. Nothing but an empty `test` where a file of data has
/// gone since the training began.
Report tests_report(const training::TestResults& results);
/// The key growth; none where there are no such tests.
Report growths_report(const training::GrowthResults& results);

}  // namespace dpde::report
