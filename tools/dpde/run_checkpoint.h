// SPDX-License-Identifier: Apache-2.0
// Checkpoints of a run: SCENE.restart in the folder of --out, at intervals of steps or seconds and when the run is
// stopped; with it SCENE.frames, the states of its output so far.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "command.h"
#include "driver/report/restart_file.h"
#include "record.h"

namespace dpde::tools {

/// "500" (steps), "30s", "10min", "2h".
struct CheckpointInterval {
  int steps = 0;
  double seconds = 0;
};
std::optional<CheckpointInterval> parse_interval(const std::string& text);

class RunCheckpoint {
 public:
  RunCheckpoint(Job& job, driver::Session& session, Record& record, FrameFile& frames, CheckpointInterval interval);
  /// SCENE.restart in the folder of --out.
  static std::filesystem::path path_of(const Job& job, const driver::Session& session);

  /// Restores the run at the checkpoint and returns the number of its state; 0 if there is none; nullopt after a
  /// diagnostic.
  std::optional<int> resume();
  /// Writes a checkpoint if it is due.
  void look(const Snapshot& snapshot);
  void save(int step, const std::vector<void*>& states);

 private:
  Job& job_;
  driver::Session& session_;
  Record& record_;
  CheckpointInterval interval_;
  std::filesystem::path path_;
  driver::RunIdentity identity_;
  FrameFile& frames_;
  int last_step_ = 0;
  std::chrono::steady_clock::time_point last_time_ = std::chrono::steady_clock::now();
};

}  // namespace dpde::tools
