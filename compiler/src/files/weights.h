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

/// By name of the network.
using NetworkWeights = std::map<std::string, std::vector<double>>;

/// Weights that the scene, or the task that learns them, reads from files (dpde/runtime/weights_file.h); others are
/// initialised by their seed. Reports cannot-read and bad-array-file where the file is named.
std::optional<NetworkWeights> load_weights(const model::Problem& problem, const SourceFile& source,
                                           DiagnosticSink& sink);

/// Hash of all files from which the scene and its task read fields, states and weights; trajectories have their own
/// hash. Work begun with other bytes cannot be resumed.
std::uint64_t hash_of_files(const model::Problem& problem, const SourceFile& source);

}  // namespace dpde::files
