// SPDX-License-Identifier: Apache-2.0
// Data of a task for a scene with other states. These are computed from the states in the file, by formulas of the
// task's own scene on the grid of the file.
#pragma once

#include <optional>
#include <string>

#include "driver/compile/pipeline.h"
#include "files/trajectories.h"

namespace dpde::training {

/// For a scene compared in the task's tests: the content of the file, mapped as the tests specify. Messages refer to
/// `where`, or to the formula.
std::optional<files::Trajectories> load_beside(const driver::Compiled& own, const model::Problem& scene,
                                               const std::string& file, const SourceFile& source, SourceRange where,
                                               DiagnosticSink& sink);

}  // namespace dpde::training
