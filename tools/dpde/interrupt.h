// SPDX-License-Identifier: Apache-2.0
// Ctrl-C and SIGTERM raise a flag that runs look at between steps; a second signal ends the process at once.
#pragma once

#include <atomic>

namespace dpde::tools {

/// Installs the handlers at the first call. The flag stays raised.
const std::atomic<bool>& interrupt_flag();

}  // namespace dpde::tools
