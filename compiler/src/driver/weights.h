// SPDX-License-Identifier: Apache-2.0
// Weights of networks from files.
#pragma once

#include <optional>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::driver {

/// The weights of a network of the problem from the file that an unknown of the task begins with (dpde/runtime/weights_file.h).
/// Reports cannot-read and bad-array-file at its place.
std::optional<std::vector<double>> load_weights(const model::Problem& problem, const model::Unknown& unknown, const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::driver
