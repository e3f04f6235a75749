// SPDX-License-Identifier: Apache-2.0
// Runs of hosts on disk, to go on later.
#pragma once

#include <filesystem>

#include "dpde/runtime/frame_file.h"
#include "dpde/runtime/run_file.h"
#include "dpde/runtime/simulation.h"

namespace dpde::host {

/// `run`: with the present parameters. False for states that are not finite: the file that is there stays.
/// @throws Error(machine)
bool save_run(const std::filesystem::path& path, Simulation& simulation, const RunDescription& run, RunRecord& record,
              FrameFile& frames);
/// The simulation and the record, a new one, stand where it was saved; false: there is no such file, and nothing was
/// changed. @throws Error(input) where it is damaged or of another run: the record is of no use then.
bool resume_run(const std::filesystem::path& path, Simulation& simulation, const RunDescription& run,
                RunRecord& record);

}  // namespace dpde::host
