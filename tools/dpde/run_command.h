// SPDX-License-Identifier: Apache-2.0
// The whole command as a function: what main() calls, and tests without a process.
#pragma once

#include <string>
#include <vector>

#include "command.h"

namespace dpde::tools {

/// `arguments`: what stands behind `dpde`. The exit status. Folders are those of the process, and so are signals: once
/// a verb has looked for Ctrl-C, interrupt_flag() has its handlers.
int run_command(const std::vector<std::string>& arguments, const Streams& streams);

}  // namespace dpde::tools
