// SPDX-License-Identifier: Apache-2.0
// Ctrl-C, SIGTERM and SIGHUP (a closed terminal) set a flag that runs check between steps; a second signal ends the
// process immediately. A signal that is ignored at the start of the process (nohup, background jobs of scripts) stays
// ignored.
#pragma once

#include <atomic>

namespace dpde::tools {

/// Installs the handlers at the first call. The flag stays set.
const std::atomic<bool>& interrupt_flag();

/// Returns `status`. If a signal was received, ends the process by it instead, so that a shell's loop ends too. Call at
/// the very end, when nothing remains to be saved or removed.
int status_or_signal(int status);

}  // namespace dpde::tools
