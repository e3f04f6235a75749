// SPDX-License-Identifier: Apache-2.0
// What the tests of a training say: in words, as tables, curves and JSON.
#pragma once

#include <string>

#include "report/report.h"
#include "training/tests/test_results.h"
#include "training/tests/trajectory_test.h"

namespace dpde::report {

/// The keys test, statistic, spectrum and correlation of the JSON. Nothing but an empty `test` where a file of data has
/// gone since the training began.
Report tests_report(const training::TestResults& results);
/// The key growth; none where there are no such tests.
Report growths_report(const training::GrowthResults& results);

/// Weights are the network's in all scenes: what is learnt stands above the file of weights that a scene beside names.
/// Warnings of such files, a line each.
std::string weights_not_used_text(const training::TestScenes& scenes);

}  // namespace dpde::report
