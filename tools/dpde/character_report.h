// SPDX-License-Identifier: Apache-2.0
// What `dpde check` says of a step beside its stability: cell numbers, positivity, damping and delay of waves.
#pragma once

#include <string>

#include "command.h"
#include "stability/verdict.h"

namespace dpde::tools {

/// `cell_numbers` and `monotone` of the result, with a warning where central differences ring; the text.
std::string report_character(Job& job, driver::Session& session, const stability::Verdict& verdict, Json& result);

/// `waves` of the result, and the table.
std::string report_waves(const driver::Session& session, const stability::Verdict& verdict, Json& result);

}  // namespace dpde::tools
