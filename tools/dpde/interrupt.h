// SPDX-License-Identifier: Apache-2.0
// Ctrl-C, SIGTERM and SIGHUP (a terminal that is closed) raise a flag that runs look at between steps; a second signal
// ends the process at once. A signal that is ignored where the process starts (nohup, background jobs of scripts) stays
// so.
#pragma once

#include <atomic>

namespace dpde::tools {

/// Installs the handlers at the first call. The flag stays raised.
const std::atomic<bool>& interrupt_flag();

/// `status`; where a signal was taken, the process ends by it instead, so that a shell's loop ends too. At the very
/// end: nothing is left to be saved or removed.
int status_or_signal(int status);

}  // namespace dpde::tools
