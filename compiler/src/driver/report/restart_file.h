// SPDX-License-Identifier: Apache-2.0
// A run that stopped on its way, on disk: the state it had reached, and what it is a run of.
//
// File: "dpderst3", then texts and numbers with their lengths, then a checksum of all before it. Written atomically.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dpde/runtime/bytes.h"
#include "driver/scene/session.h"
#include "source/diagnostic.h"

namespace dpde::driver {

/// What has to be the same for a run to go on to the same end: by name ("grid", "step"), in the order of their weight.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;
RunIdentity identity_of(Session& session);
/// The same but for parameters and the start, which hosts set; and with parameters.
RunIdentity identity_of(const Compiled& compiled);
void add_params(RunIdentity& identity, std::string params);

struct Restart {
  RunIdentity identity;
  int step = 0;
  std::vector<std::vector<double>> states;  // dense, in the order of the rollout
  StepController controller;                // of steps under a tolerance
  std::string record;                       // the caller's own
};

/// With a checksum behind it; and what is before it, nullopt where it does not fit: so files that a kill or a disk has
/// damaged are known.
std::string sealed(std::string content);
std::optional<std::string_view> unsealed(std::string_view bytes);

/// Reports machine-failed; false then.
bool save_restart(const std::filesystem::path& path, const Restart& restart, DiagnosticSink& sink);
/// Reports cannot-read, bad-array-file when it is damaged, and restart-differs when it is of another run.
std::optional<Restart> load_restart(const std::filesystem::path& path, const RunIdentity& identity,
                                    DiagnosticSink& sink);

}  // namespace dpde::driver
