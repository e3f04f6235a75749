// SPDX-License-Identifier: Apache-2.0
// Comparison of a network with plain schemes in a test: measure by run, cost at equal error, error at equal cost.
#pragma once

#include "report/training/one_test.h"

namespace dpde::report {

/// One row for each named scene and each other plain method on the Pareto front. Reports the cost of plain schemes at
/// the network's error and their error at its cost, also by kind of method, and runs in which the network is not
/// better.
void report_beside(Report& report, const OneTest& test, Json& json);

}  // namespace dpde::report
