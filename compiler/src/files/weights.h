// SPDX-License-Identifier: Apache-2.0
// Weights of networks from files.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::files {

/// By the name of the network.
using NetworkWeights = std::map<std::string, std::vector<double>>;

/// Those that the scene, or the task that learns them, takes from files (dpde/runtime/weights_file.h); others begin as
/// their seed says. Reports cannot-read and bad-array-file where the file is named.
std::optional<NetworkWeights> load_weights(const model::Problem& problem, const SourceFile& source,
                                           DiagnosticSink& sink);

/// Of the bytes of all files that the scene and its task take fields, states and weights from; trajectories have a hash
/// of their own. What was begun with other bytes cannot go on.
std::uint64_t hash_of_files(const model::Problem& problem, const SourceFile& source);

}  // namespace dpde::files
