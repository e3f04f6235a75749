// SPDX-License-Identifier: Apache-2.0
// What a test says of plain schemes beside a network: its figure by run, and what they take for the same.
#pragma once

#include "report/training/one_test.h"

namespace dpde::report {

/// A row of each scene named, and of the other plain methods those that are the best for their time; what plain schemes
/// take for the network's figure and have for its time, by kinds of method too; where the network is no better.
void report_beside(Report& report, const OneTest& test, Json& json);

}  // namespace dpde::report
