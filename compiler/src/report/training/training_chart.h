// SPDX-License-Identifier: Apache-2.0
// Chart of a trained network: error on unseen data against seconds for a unit of time, compared with plain methods; and
// its cost with data and training, compared with the plain method of the same error.
#pragma once

#include "report/report.h"
#include "training/tests/test_results.h"
#include "training/tests/trajectory_test.h"

namespace dpde::report {

/// `results`: results of the tests of `scenes`. Makes the picture and table TEST_chart, and the keys points and
/// best_plain.
Report training_chart(const training::TestScenes& scenes, const training::TestResults& results);

}  // namespace dpde::report
