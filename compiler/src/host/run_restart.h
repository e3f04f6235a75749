// SPDX-License-Identifier: Apache-2.0
// Runs of hosts on disk, to go on later.
#pragma once

#include <filesystem>

#include "dpde/runtime/frame_file.h"
#include "dpde/runtime/run_file.h"
#include "dpde/runtime/simulation.h"

namespace dpde::host {

/// `run`: with the present parameters. @throws Error(machine)
void save_run(const std::filesystem::path& path, Simulation& simulation, const RunDescription& run, RunRecord& record,
              FrameFile& frames);
/// The simulation and the record stand where it was saved; false: there is no such file, and nothing was changed.
/// @throws Error(input) where it is damaged or of another run.
bool resume_run(const std::filesystem::path& path, Simulation& simulation, const RunDescription& run,
                RunRecord& record);

}  // namespace dpde::host
