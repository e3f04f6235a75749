// SPDX-License-Identifier: Apache-2.0
// Saves runs of hosts on disk and resumes them.
#pragma once

#include <filesystem>

#include "dpde/runtime/frame_file.h"
#include "dpde/runtime/run_file.h"
#include "dpde/runtime/simulation.h"

namespace dpde::host {

/// `run`: description with the present parameters. Returns false if states are not finite; an existing file is then
/// kept. @throws Error(machine)
bool save_run(const std::filesystem::path& path, Simulation& simulation, const RunDescription& run, RunRecord& record,
              FrameFile& frames);
/// Sets the simulation and a new record to the saved state. Returns false, with nothing changed, if the file does not
/// exist. @throws Error(input) if it is damaged or of another run; the record is then unusable.
bool resume_run(const std::filesystem::path& path, Simulation& simulation, const RunDescription& run,
                RunRecord& record);

}  // namespace dpde::host
