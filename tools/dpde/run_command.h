// SPDX-License-Identifier: Apache-2.0
// The whole command as a function: for main(), and for tests without a process.
#pragma once

#include <string>
#include <vector>

#include "command.h"

namespace dpde::tools {

/// `arguments`: those after `dpde`. Returns the exit status. Uses the folders and signals of the process: once a verb
/// has called interrupt_flag() its handlers are installed.
int run_command(const std::vector<std::string>& arguments, const Streams& streams);

}  // namespace dpde::tools
