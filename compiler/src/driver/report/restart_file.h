// SPDX-License-Identifier: Apache-2.0
// File of an interrupted run: the state it had reached, and an identification of the run.
//
// Format: "dpderst3", then texts and numbers with their lengths, then a checksum of all that precedes. Written
// atomically.
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

/// Properties that must be equal for a run to continue to the same result: name ("grid", "step") and value, most
/// important first.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;
RunIdentity identity_of(Session& session);
/// The same without parameters and start, which hosts set; add_params adds the parameters.
RunIdentity identity_of(const Compiled& compiled);
void add_params(RunIdentity& identity, std::string params);

struct Restart {
  RunIdentity identity;
  int step = 0;
  std::vector<std::vector<double>> states;  // without ghost cells, in the order of the rollout
  StepController controller;                // for steps with a tolerance
  std::string record;                       // data of the caller
};

/// sealed: appends a checksum. unsealed: the content without it, or nullopt if the checksum does not match, i.e. the
/// file is damaged.
std::string sealed(std::string content);
std::optional<std::string_view> unsealed(std::string_view bytes);

/// Returns false and reports machine-failed on failure.
bool save_restart(const std::filesystem::path& path, const Restart& restart, DiagnosticSink& sink);
/// Reports cannot-read; bad-array-file if it is damaged; restart-differs if it belongs to another run.
std::optional<Restart> load_restart(const std::filesystem::path& path, const RunIdentity& identity,
                                    DiagnosticSink& sink);

}  // namespace dpde::driver
