// SPDX-License-Identifier: Apache-2.0
// How equations were solved, and why so, as JSON. The words are driver::text_of.
#pragma once

#include <vector>

#include "driver/report/solve_report.h"
#include "support/json.h"

namespace dpde::report {

Json json_of(const std::vector<driver::SolveReport>& solves);

}  // namespace dpde::report
