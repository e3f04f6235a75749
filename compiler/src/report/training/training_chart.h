// SPDX-License-Identifier: Apache-2.0
// A trained network on a chart: its error on data that it has not seen against the seconds of a unit of time, beside
// plain methods; and what it costs with data and training, beside the plain method of the same error.
#pragma once

#include "report/report.h"
#include "training/tests/test_results.h"
#include "training/tests/trajectory_test.h"

namespace dpde::report {

/// `results` are those of the tests of `scenes`. The picture and table TEST_chart, and the keys points and best_plain.
Report training_chart(const training::TestScenes& scenes, const training::TestResults& results);

}  // namespace dpde::report
