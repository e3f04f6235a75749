// SPDX-License-Identifier: Apache-2.0
// Data of a task as a scene of other states has them: its states are made of those that the file has, by formulas of
// the task's own scene on the grid of the file.
#pragma once

#include <optional>
#include <string>

#include "driver/compile/pipeline.h"
#include "files/trajectories.h"

namespace dpde::training {

/// Of a scene beside the task's tests: what the file holds, or what is made of it where the tests say how. Messages are
/// about `where`, or where the formula stands.
std::optional<files::Trajectories> load_beside(const driver::Compiled& own, const model::Problem& scene,
                                               const std::string& file, const SourceFile& source, SourceRange where,
                                               DiagnosticSink& sink);

}  // namespace dpde::training
